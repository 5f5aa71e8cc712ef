//! What has to be known about a file before its messages can be read.

use std::collections::{BTreeMap, HashMap};

use super::parsed::{ChannelRecord, Definition, SchemaRecord};

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
    /// Stores what a record defines; a later definition replaces an earlier one.
    pub(crate) fn define(&mut self, definition: &Definition<'_>) {
        match definition {
            Definition::Schema { id, schema } => {
                self.schemas.insert(*id, Schema::from_record(schema));
            }
            Definition::Channel { id, channel } => {
                self.channels.insert(*id, Channel::from_record(channel));
            }
        }
    }
}
