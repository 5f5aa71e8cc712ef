//! Records after parsing, borrowed from the bytes of the file.

use std::collections::BTreeMap;

use crate::message::{RawMessage, TopicId};

/// A message.
pub(crate) struct MessageRecord<'a> {
    pub(crate) channel_id: u32,
    pub(crate) sequence: u32,
    pub(crate) log_time_ns: i64,
    pub(crate) publish_time_ns: i64,
    pub(crate) data: &'a [u8],
}

impl<'a> MessageRecord<'a> {
    /// The message, on the topic of its channel and from that writer of it.
    #[inline]
    pub(super) fn message(&self, topic: TopicId, writer: u32) -> RawMessage<'a> {
        RawMessage {
            topic,
            writer,
            log_time_ns: self.log_time_ns,
            publish_time_ns: self.publish_time_ns,
            sequence: self.sequence,
            data: self.data,
        }
    }
}

/// Definition in a record: a schema or a channel.
pub(crate) enum DefinitionRecord<'a> {
    Schema { id: u32, schema: SchemaRecord<'a> },
    Channel { id: u32, channel: Channel },
}

/// A message type.
pub(crate) struct SchemaRecord<'a> {
    pub(crate) name: &'a str,
    pub(crate) encoding: &'a str,
    pub(crate) data: &'a [u8],
}

/// A topic of one writer.
#[derive(Clone)]
pub(crate) struct Channel {
    /// `None` for messages without a type.
    pub(crate) schema_id: Option<u32>,
    pub(crate) topic: String,
    pub(crate) encoding: String,
    /// Keys and values that the log records of the writer.
    pub(crate) says: BTreeMap<String, String>,
}

impl Channel {
    /// Whether both define the same channel, whatever they record of its writer.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let of = (self.schema_id, &self.topic, &self.encoding);
        of == (other.schema_id, &other.topic, &other.encoding)
    }
}
