//! The index at the end of a bag: every connection, and for each chunk its place, its times and
//! how many messages of which connection it holds.

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

/// Room for the index of a few million chunks; beyond that a scan is the safer way.
const INDEX_LIMIT_BYTES: u64 = 1 << 30;

/// What the index tells; `None` if it is absent, incomplete or damaged.
pub(super) fn read(file: &FileBytes) -> Result<Option<Contents>, Error> {
    let Some(promise) = Promise::read(file)? else {
        return Ok(None);
    };
    let index_bytes = file.len() - promise.index_position;
    if index_bytes > INDEX_LIMIT_BYTES {
        return Ok(None);
    }
    let bytes = file.read_vec(promise.index_position, index_bytes)?;
    Ok(parse(&bytes, &promise))
}

/// What the first record of a bag says about the index.
struct Promise {
    index_position: u64,
    connections: Option<u32>,
    chunks: Option<u32>,
}

impl Promise {
    fn read(file: &FileBytes) -> Result<Option<Self>, Error> {
        let start = header::FIRST_RECORD;
        let count = (header::HEAD_BYTES as u64).min(file.len().saturating_sub(start));
        let bytes = file.read_vec(start, count)?;
        let promise = Self::parse(&bytes);
        // A bag that was not closed has a zero there.
        Ok(promise.filter(|promise| {
            promise.index_position > start && promise.index_position < file.len()
        }))
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

fn parse(mut bytes: &[u8], promise: &Promise) -> Option<Contents> {
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
    let is_complete = promise
        .connections
        .is_none_or(|count| count as usize == contents.channels.len())
        && promise
            .chunks
            .is_none_or(|count| count as usize == contents.chunks.len())
        && counts.keys().all(|id| contents.channels.contains_key(id));
    // Messages outside chunks would not be counted; no writer makes them.
    contents.message_counts = Some(counts);
    contents.counts_are_promised = true;
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
        channels: Some(counts.iter().map(|(id, _)| *id).collect()),
        counts,
        span_ns: header.start_ns.zip(header.end_ns),
    })
}
