//! Maps the channels of a file to topics, and marks the wanted ones.

use std::collections::BTreeMap;

use super::{contents::Contents, parsed::DefinitionRecord, visitor::Next};
use crate::message::{TopicDescription, TopicId, TopicTable};

/// The channels of a file and their topics.
pub(super) struct ChannelTable {
    pub(super) by_id: BTreeMap<u32, ChannelTopic>,
}

pub(super) struct ChannelTopic {
    pub(super) topic: TopicId,
    pub(super) writer: u32,
    pub(super) name: String,
    /// Messages counted by the file's index.
    pub(super) indexed_count: Option<u64>,
}

impl ChannelTable {
    pub(super) fn register(contents: &Contents, topics: &mut TopicTable) -> Self {
        let mut by_id = BTreeMap::new();
        for (&id, channel) in &contents.channels {
            let schema = channel.schema_id.and_then(|id| contents.schemas.get(&id));
            let description = TopicDescription {
                name: &channel.topic,
                type_name: schema.map_or("", |schema| &schema.name),
                encoding: &channel.encoding,
                schema_encoding: schema.map_or("", |schema| &schema.encoding),
                definition: schema.map(|schema| schema.data.as_slice()),
            };
            let (topic, writer) = topics.register_writer(&description, &channel.says);
            let counts = contents.message_counts.as_ref();
            let count = counts.map(|counts| counts.get(&id).copied().unwrap_or(0));
            topics.add_messages(topic, count);
            let entry = ChannelTopic {
                topic,
                writer,
                name: channel.topic.clone(),
                indexed_count: count.filter(|_| contents.counts_are_indexed),
            };
            by_id.insert(id, entry);
        }
        Self { by_id }
    }
}

#[derive(Clone, Copy)]
pub(super) enum ChannelUse {
    Undefined,
    Unwanted,
    /// The topic, and which of its writers.
    Wanted(TopicId, u32),
}

/// Channel ids below this use a lookup table.
const TABLE_LIMIT: u32 = 1 << 16;

/// Wanted channels; shared by all threads.
pub(super) struct Routes<'d> {
    pub(super) channels: &'d ChannelTable,
    pub(super) wanted: &'d [bool],
    uses: Vec<ChannelUse>,
}

impl<'d> Routes<'d> {
    pub(super) fn new(channels: &'d ChannelTable, wanted: &'d [bool]) -> Self {
        let last_in_table = channels.by_id.range(..TABLE_LIMIT).next_back();
        let count = last_in_table.map_or(0, |(&id, _)| id + 1);
        let mut routes = Self {
            channels,
            wanted,
            uses: Vec::new(),
        };
        routes.uses = (0..count).map(|id| routes.look_up(id)).collect();
        routes
    }

    pub(super) fn wants(&self, topic: TopicId) -> bool {
        self.wanted.get(topic.index()).copied().unwrap_or(false)
    }

    fn look_up(&self, channel_id: u32) -> ChannelUse {
        match self.channels.by_id.get(&channel_id) {
            None => ChannelUse::Undefined,
            Some(entry) if self.wants(entry.topic) => ChannelUse::Wanted(entry.topic, entry.writer),
            Some(_) => ChannelUse::Unwanted,
        }
    }

    /// Returns the number of channels in the lookup table.
    pub(super) fn table_size(&self) -> usize {
        self.uses.len()
    }

    #[inline]
    pub(super) fn channel_use(&self, channel_id: u32) -> ChannelUse {
        match self.uses.get(channel_id as usize) {
            Some(found) => *found,
            None => self.look_up(channel_id),
        }
    }

    /// The topic and the writer of a wanted channel, or how the walk proceeds without its message.
    #[inline]
    pub(super) fn wanted_topic(&self, channel_id: u32) -> Result<(TopicId, u32), Next> {
        match self.channel_use(channel_id) {
            ChannelUse::Wanted(topic, writer) => Ok((topic, writer)),
            ChannelUse::Unwanted => Err(Next::Continue),
            ChannelUse::Undefined => Err(Next::UndefinedChannel),
        }
    }

    /// Whether a definition agrees with the index, which takes precedence.
    pub(super) fn agrees(&self, definition: &DefinitionRecord<'_>) -> bool {
        match definition {
            DefinitionRecord::Schema { .. } => true,
            DefinitionRecord::Channel { id, channel } => {
                let known = self.channels.by_id.get(id);
                known.is_none_or(|known| known.name == channel.topic)
            }
        }
    }

    pub(super) fn topic_name(&self, channel_id: u32) -> Option<&str> {
        let entry = self.channels.by_id.get(&channel_id);
        entry.map(|entry| entry.name.as_str())
    }
}
