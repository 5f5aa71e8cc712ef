//! The table of contents of a file: topics, schemas and chunks.

use std::{
    collections::{BTreeMap, HashMap},
    ops::Range,
};

use super::parsed::{Channel, DefinitionRecord, SchemaRecord};

/// The chunks found in the index or by a scan, by offset.
pub(crate) type ChunkDirectory = BTreeMap<u64, ChunkEntry>;

/// Properties of a chunk that are known before it is read.
#[derive(Debug, Clone, Default)]
pub(crate) struct ChunkEntry {
    /// The length of its record, if the index states it.
    pub(crate) length_bytes: Option<u64>,
    /// The channels in it; `None` if unknown.
    pub(crate) channels: Option<Vec<u32>>,
    /// Message counts by channel, if the index has them.
    pub(crate) counts: Vec<(u32, u64)>,
    /// The log times of its first and last message.
    pub(crate) span_ns: Option<(i64, i64)>,
}

#[derive(Default)]
pub(crate) struct Contents {
    pub(crate) schemas: HashMap<u32, Schema>,
    pub(crate) channels: BTreeMap<u32, Channel>,
    /// `None` if unknown.
    pub(crate) message_counts: Option<BTreeMap<u32, u64>>,
    /// Whether the counts come from an index, not from a scan.
    pub(crate) counts_are_indexed: bool,
    /// Log times of the first and the last message, by the statistics or a scan; `None` if unknown.
    pub(crate) span_ns: Option<(i64, i64)>,
    pub(crate) chunks: ChunkDirectory,
    /// Attachments and metadata records by the index; `None` if it does not list all.
    pub(crate) extras: Option<Vec<ExtraPlace>>,
}

/// Position of an attachment or a metadata record.
#[derive(Clone)]
pub(crate) struct ExtraPlace {
    pub(crate) bytes: Range<u64>,
    pub(crate) is_attachment: bool,
}

pub(crate) struct Schema {
    pub(crate) name: String,
    pub(crate) encoding: String,
    pub(crate) data: Vec<u8>,
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

impl Contents {
    /// Returns the log times of the first and the last message, by all statements of the file.
    pub(crate) fn whole_span_ns(&self) -> Option<(i64, i64)> {
        let of_chunks = self.chunks.values().filter_map(|chunk| chunk.span_ns);
        self.span_ns.into_iter().chain(of_chunks).reduce(widest)
    }

    /// Stores what a record defines; a later definition replaces an earlier one.
    pub(crate) fn define(&mut self, definition: &DefinitionRecord<'_>) {
        match definition {
            DefinitionRecord::Schema { id, schema } => {
                self.schemas.insert(*id, Schema::from_record(schema));
            }
            DefinitionRecord::Channel { id, channel } => {
                self.channels.insert(*id, channel.clone());
            }
        }
    }
}

/// The span that contains both.
pub(crate) fn widest(a: (i64, i64), b: (i64, i64)) -> (i64, i64) {
    (a.0.min(b.0), a.1.max(b.1))
}
