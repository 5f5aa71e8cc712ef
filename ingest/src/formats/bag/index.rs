//! Reads the index at the end of a bag: all connections, and for each chunk its offset, its times
//! and its message counts.

use std::collections::BTreeMap;

use super::{
    connection::connection,
    header::{self, op},
};
use crate::{
    file::FileBytes,
    formats::records::{ChunkEntry, Contents},
    message::Error,
};

/// Enough for a few million chunks; beyond that a scan is safer.
const INDEX_LIMIT_BYTES: u64 = 1 << 30;

/// The contents by the index; `None` if it is absent, incomplete or damaged.
pub(super) fn read(file: &FileBytes) -> Result<Option<Contents>, Error> {
    let Some(header) = IndexHeader::read(file)? else {
        return Ok(None);
    };
    let index_bytes = file.len() - header.index_position;
    if index_bytes > INDEX_LIMIT_BYTES {
        return Ok(None);
    }
    let bytes = file.read_vec(header.index_position, index_bytes)?;
    Ok(parse(&bytes, &header))
}

/// Statements of the first record of a bag about the index.
struct IndexHeader {
    index_position: u64,
    connections: Option<u32>,
    chunks: Option<u32>,
}

impl IndexHeader {
    fn read(file: &FileBytes) -> Result<Option<Self>, Error> {
        let start = header::FIRST_RECORD;
        let count = (header::HEAD_BYTES as u64).min(file.len().saturating_sub(start));
        let bytes = file.read_vec(start, count)?;
        let header = Self::parse(&bytes);
        // The position is zero in a bag that was not closed; it is the end of one that was closed without messages.
        let is_inside =
            |header: &Self| header.index_position > start && header.index_position <= file.len();
        Ok(header.filter(is_inside))
    }

    fn parse(bytes: &[u8]) -> Option<Self> {
        let (header, ..) = header::frame(bytes)?;
        if header.op != op::BAG_HEADER {
            return None;
        }
        Some(Self {
            index_position: header.index_position?,
            connections: header.connection_count,
            chunks: header.chunk_count,
        })
    }
}

fn parse(mut bytes: &[u8], header: &IndexHeader) -> Option<Contents> {
    let mut contents = Contents::default();
    let mut counts: BTreeMap<u32, u64> = BTreeMap::new();
    while !bytes.is_empty() {
        let (_, record, rest) = header::split_first(bytes)?;
        let (header, data) = header::split(record)?;
        match header.op {
            op::CONNECTION => connection(record, &mut |definition| {
                contents.define(&definition);
            })?,
            op::CHUNK_INFO => {
                let entry = chunk_entry(&header, data)?;
                for (id, count) in &entry.counts {
                    let sum = counts.entry(*id).or_default();
                    *sum = sum.saturating_add(*count);
                }
                contents.chunks.insert(header.chunk_position?, entry);
            }
            _ => return None,
        }
        bytes = rest;
    }
    // an index that is cut off is empty, too
    let agrees = |stated: Option<u32>, found: usize| {
        stated.map_or(found > 0, |count| count as usize == found)
    };
    let is_complete = agrees(header.connections, contents.channels.len())
        && agrees(header.chunks, contents.chunks.len())
        && counts.keys().all(|id| contents.channels.contains_key(id));
    // Messages outside chunks would not be counted, but no writer creates them.
    contents.message_counts = Some(counts);
    contents.counts_are_indexed = true;
    contents.extras = Some(Vec::new());
    is_complete.then_some(contents)
}

fn chunk_entry(header: &header::Header<'_>, data: &[u8]) -> Option<ChunkEntry> {
    let (pairs, rest) = data.as_chunks::<8>();
    if !rest.is_empty() {
        return None;
    }
    let number = |bytes: &[u8]| bytes.first_chunk().map_or(0, |b| u32::from_le_bytes(*b));
    let counts: Vec<(u32, u64)> = pairs
        .iter()
        .map(|pair| (number(&pair[..4]), u64::from(number(&pair[4..]))))
        .collect();
    Some(ChunkEntry {
        length_bytes: None,
        channels: Some(counts.iter().map(|(id, _)| *id).collect()),
        counts,
        span_ns: header.start_ns.zip(header.end_ns),
    })
}
