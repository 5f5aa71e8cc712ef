//! What has to be known about a file before its messages can be read.

use std::collections::{BTreeMap, HashMap};

use super::{ChannelRecord, Grammar, HeadWindow, Kind, SchemaRecord};
use crate::{error::Error, file_bytes::FileBytes, losses::Losses};

/// The chunks that an index or a scan knows, by their offsets.
pub(crate) type ChunkDirectory = BTreeMap<u64, ChunkEntry>;

/// What is known about a chunk before it is read.
#[derive(Debug, Clone, Default)]
pub(crate) struct ChunkEntry {
    /// Which channels it holds; `None` when that is not known.
    pub(crate) channels: Option<Vec<u32>>,
    /// Messages by channel, where the index counts them.
    pub(crate) counts: Vec<(u32, u64)>,
    /// The log times of its first and last message.
    pub(crate) span_ns: Option<(i64, i64)>,
}

#[derive(Default)]
pub(crate) struct Contents {
    pub(crate) schemas: HashMap<u32, Schema>,
    pub(crate) channels: BTreeMap<u32, Channel>,
    /// `None` when the file does not tell.
    pub(crate) message_counts: Option<BTreeMap<u32, u64>>,
    /// Whether the counts are those of an index and not those of a scan.
    pub(crate) counts_are_promised: bool,
    pub(crate) chunks: ChunkDirectory,
}

pub(crate) struct Schema {
    pub(crate) name: String,
    pub(crate) encoding: String,
    pub(crate) data: Vec<u8>,
}

#[derive(PartialEq)]
pub(crate) struct Channel {
    pub(crate) schema_id: Option<u32>,
    pub(crate) topic: String,
    pub(crate) encoding: String,
}

impl Schema {
    pub(crate) fn from_record(record: &SchemaRecord<'_>) -> Self {
        Self {
            name: record.name.to_owned(),
            encoding: record.encoding.to_owned(),
            data: record.data.to_vec(),
        }
    }
}

impl Channel {
    pub(crate) fn from_record(record: &ChannelRecord<'_>) -> Self {
        Self {
            schema_id: record.schema_id,
            topic: record.topic.to_owned(),
            encoding: record.encoding.to_owned(),
        }
    }
}

impl Contents {
    /// Drops the chunks that are not where the index says, and looks whether the first one has a
    /// checksum.
    pub(super) fn drop_wrong_places<G: Grammar>(
        &mut self,
        file: &FileBytes,
        losses: &mut Losses,
    ) -> Result<(), Error> {
        let mut window = HeadWindow::new(file);
        let mut wrong = Vec::new();
        let mut is_first = true;
        for &offset in self.chunks.keys() {
            let head = window.bytes(offset, G::HEAD_BYTES as u64)?;
            let is_chunk = G::frame(head).is_some_and(|frame| frame.kind == Kind::Chunk);
            match G::chunk(head).filter(|_| is_chunk) {
                Some(chunk) if is_first => losses.saw_checksum(chunk.has_checksum()),
                Some(_) => {}
                None => wrong.push(offset),
            }
            is_first = false;
        }
        if let Some(first) = wrong.first() {
            losses.note(format!(
                "{}: the index leads to {} places where no chunk is, the first of them byte {first}",
                file.path().display(),
                wrong.len(),
            ));
        }
        self.chunks.retain(|offset, _| !wrong.contains(offset));
        Ok(())
    }
}
