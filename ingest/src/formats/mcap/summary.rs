//! Reads topics and chunk index from the summary at the end of a file, if it is intact.

use std::{collections::BTreeMap, ops::Range};

use mcap::records::op;

use super::record::{self, ChunkIndexRecord, Fields, RECORD_HEADER_BYTES};
use crate::{
    file::FileBytes,
    formats::records::{ChunkEntry, Contents, ExtraPlace},
    message::Error,
};

const MAGIC_BYTES: usize = mcap::MAGIC.len();
const FOOTER_BODY_BYTES: usize = 20;
const FOOTER_BYTES: usize = RECORD_HEADER_BYTES + FOOTER_BODY_BYTES;
const TAIL_BYTES: usize = FOOTER_BYTES + MAGIC_BYTES;
/// The checksum covers the footer up to the checksum.
const CHECKED_FOOTER_BYTES: u64 = (FOOTER_BYTES - 4) as u64;
/// Enough for a few million chunks; beyond that a scan is safer.
const SUMMARY_LIMIT_BYTES: u64 = 1 << 30;

/// The contents by the summary; `None` if it is absent, incomplete or damaged.
pub(super) fn read(file: &FileBytes) -> Result<Option<Contents>, Error> {
    let Some(footer) = Footer::read(file)? else {
        return Ok(None);
    };
    let summary_bytes = footer.offset - footer.summary_start;
    if summary_bytes > SUMMARY_LIMIT_BYTES {
        return Ok(None);
    }
    let checked = file.read_vec(footer.summary_start, summary_bytes + CHECKED_FOOTER_BYTES)?;
    if footer.summary_crc != 0 && crc32fast::hash(&checked) != footer.summary_crc {
        return Ok(None);
    }
    let records = checked.get(..summary_bytes as usize).unwrap_or_default();
    let Some((mut contents, indexes)) = parse(records, footer.summary_start) else {
        return Ok(None);
    };
    // Of a file in a bucket each read would cost a request.
    if contents.message_counts.is_none() && !file.is_partial() {
        contents.message_counts = counted(file, &contents, &indexes)?;
        contents.counts_are_indexed = contents.message_counts.is_some();
    }
    Ok(Some(contents))
}

/// Message counts by channel, by the message indexes behind each chunk; `None` if they are not all there.
fn counted(
    file: &FileBytes,
    contents: &Contents,
    indexes: &[Range<u64>],
) -> Result<Option<BTreeMap<u32, u64>>, Error> {
    if contents.chunks.is_empty() {
        return Ok(None);
    }
    let mut counts = BTreeMap::new();
    let mut bytes = Vec::new();
    for (place, entry) in indexes.iter().zip(contents.chunks.values()) {
        let length = place.end - place.start;
        file.read_into(&mut bytes, place.start, length)?;
        let mut rest = bytes.as_slice();
        let mut found = Vec::new();
        while let Some((op::MESSAGE_INDEX, body, after)) = record::split_record(rest) {
            rest = after;
            let is_whole = |count: u64| count * record::INDEX_ENTRY_BYTES <= body.len() as u64;
            let Some((channel, count)) = record::index(body).filter(|(_, count)| is_whole(*count))
            else {
                return Ok(None);
            };
            found.push(channel);
            *counts.entry(channel).or_default() += count;
        }
        let listed = entry.channels.iter().flatten();
        let are_all = entry.channels.is_some() && listed.clone().all(|id| found.contains(id));
        if !rest.is_empty()
            || !are_all
            || found.iter().any(|id| !contents.channels.contains_key(id))
        {
            return Ok(None);
        }
    }
    Ok(Some(counts))
}

struct Footer {
    offset: u64,
    summary_start: u64,
    summary_crc: u32,
}

impl Footer {
    /// The footer, if the file ends with one that points to a summary.
    fn read(file: &FileBytes) -> Result<Option<Self>, Error> {
        let Some(offset) = file.len().checked_sub(TAIL_BYTES as u64) else {
            return Ok(None);
        };
        let mut tail = [0; TAIL_BYTES];
        file.read_at(offset, &mut tail)?;
        Ok(Self::parse(&tail, offset))
    }

    fn parse(tail: &[u8], offset: u64) -> Option<Self> {
        let (opcode, body, magic) = record::split_record(tail)?;
        if opcode != op::FOOTER || magic != mcap::MAGIC {
            return None;
        }
        let mut fields = Fields::new(body);
        let summary_start = fields.u64()?;
        let _summary_offset_start = fields.u64()?;
        let summary_crc = fields.u32()?;
        let in_file = summary_start >= MAGIC_BYTES as u64 && summary_start <= offset;
        in_file.then_some(Self {
            offset,
            summary_start,
            summary_crc,
        })
    }
}

/// The contents, and the places of the message indexes of each chunk, in the order of the chunks.
fn parse(mut records: &[u8], data_end: u64) -> Option<(Contents, Vec<Range<u64>>)> {
    let mut contents = Contents::default();
    let mut indexes = BTreeMap::new();
    let mut message_count = None;
    let (mut extras, mut stated_extras) = (Vec::new(), None);
    while !records.is_empty() {
        let (opcode, body, rest) = record::split_record(records)?;
        records = rest;
        match opcode {
            op::SCHEMA => contents.define(&record::schema(body)?),
            op::CHANNEL => contents.define(&record::channel(body)?),
            op::CHUNK_INDEX => {
                let (offset, place) = add_chunk(&mut contents, body, data_end)?;
                indexes.insert(offset, place);
            }
            op::ATTACHMENT_INDEX | op::METADATA_INDEX => {
                let place = record::extra_place(body).filter(|place| place.end <= data_end);
                extras.extend(place.map(|bytes| ExtraPlace {
                    bytes,
                    is_attachment: opcode == op::ATTACHMENT_INDEX,
                }));
            }
            op::STATISTICS => {
                let statistics = record::statistics(body)?;
                stated_extras = Some(statistics.extra_count);
                message_count = Some(statistics.message_count);
                contents.span_ns = statistics.span_ns;
                let by_channel = statistics.by_channel.into_iter();
                contents.message_counts = Some(by_channel.collect::<BTreeMap<_, _>>());
                contents.counts_are_indexed = true;
            }
            _ => {}
        }
    }
    extras.sort_by_key(|place| place.bytes.start);
    contents.extras = (stated_extras == Some(extras.len() as u64)).then_some(extras);
    let indexes = indexes.into_values().collect();
    is_complete(&contents, message_count).then_some((contents, indexes))
}

/// Adds a chunk; returns its offset and the place of its message indexes.
fn add_chunk(contents: &mut Contents, body: &[u8], data_end: u64) -> Option<(u64, Range<u64>)> {
    let index = ChunkIndexRecord::parse(body)?;
    let end = index.offset.checked_add(index.length_bytes)?;
    if index.offset < MAGIC_BYTES as u64 || end > data_end {
        return None;
    }
    // An entry without channels may describe a chunk whose messages were not indexed.
    let channels = (!index.channels.is_empty()).then_some(index.channels);
    let (first_ns, last_ns) = index.span_ns;
    let entry = ChunkEntry {
        length_bytes: Some(index.length_bytes),
        channels,
        counts: Vec::new(),
        span_ns: (first_ns <= last_ns && last_ns != 0).then_some((first_ns, last_ns)),
    };
    contents.chunks.insert(index.offset, entry);
    let indexes_end = end.saturating_add(index.indexes_bytes);
    // without them nothing is counted
    let indexes = end..if indexes_end <= data_end {
        indexes_end
    } else {
        end
    };
    Some((index.offset, indexes))
}

/// Whether every channel with messages is defined, including its schema.
fn is_complete(contents: &Contents, message_count: Option<u64>) -> bool {
    let Contents {
        schemas,
        channels,
        message_counts,
        chunks,
        ..
    } = contents;
    let counted = message_counts
        .iter()
        .flatten()
        .filter(|(_, count)| **count > 0);
    let counted_sum = counted
        .clone()
        .map(|(_, count)| *count)
        .fold(0, u64::saturating_add);
    let sum_agrees = message_count.is_none_or(|count| count == counted_sum);
    let mut named = counted
        .map(|(id, _)| id)
        .chain(chunks.values().flat_map(|entry| &entry.channels).flatten());
    let something_told = message_count == Some(0) || !channels.is_empty();
    something_told
        && sum_agrees
        && named.all(|id| channels.contains_key(id))
        && channels
            .values()
            .all(|channel| channel.schema_id.is_none_or(|id| schemas.contains_key(&id)))
}
