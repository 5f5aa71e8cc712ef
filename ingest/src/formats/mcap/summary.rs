//! Reads topics and chunk index from the summary at the end of a file, if it is intact.

use std::collections::BTreeMap;

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
    Ok(parse(records, footer.summary_start))
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

fn parse(mut records: &[u8], data_end: u64) -> Option<Contents> {
    let mut contents = Contents::default();
    let mut message_count = None;
    let (mut extras, mut stated_extras) = (Vec::new(), None);
    while !records.is_empty() {
        let (opcode, body, rest) = record::split_record(records)?;
        records = rest;
        match opcode {
            op::SCHEMA => contents.define(&record::schema(body)?),
            op::CHANNEL => contents.define(&record::channel(body)?),
            op::CHUNK_INDEX => add_chunk(&mut contents, body, data_end)?,
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
    is_complete(&contents, message_count).then_some(contents)
}

fn add_chunk(contents: &mut Contents, body: &[u8], data_end: u64) -> Option<()> {
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
    Some(())
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
