//! Hands the wanted messages of a walk to the caller of [`Log::read`](crate::Log::read).

use std::{collections::BTreeMap, ops::ControlFlow};

use super::{ChunkDirectory, Contents, Definition, MessageRecord, Next, Visitor};
use crate::{
    losses::Losses,
    message::Message,
    reader::Request,
    topic::{TopicDescription, TopicId, TopicTable},
};

/// The channels of a file and the topics they stand for.
pub(super) struct ChannelTable {
    by_id: BTreeMap<u32, ChannelTopic>,
}

struct ChannelTopic {
    topic: TopicId,
    name: String,
    /// How many messages the file's index counts.
    promised: Option<u64>,
}

impl ChannelTable {
    pub(super) fn register(contents: &Contents, topics: &mut TopicTable) -> Self {
        let mut by_id = BTreeMap::new();
        for (&id, channel) in &contents.channels {
            let schema = channel.schema_id.and_then(|id| contents.schemas.get(&id));
            let topic = topics.register(&TopicDescription {
                name: &channel.topic,
                type_name: schema.map_or("", |schema| &schema.name),
                encoding: &channel.encoding,
                schema_encoding: schema.map_or("", |schema| &schema.encoding),
                definition: schema.map(|schema| schema.data.as_slice()),
            });
            let counts = contents.message_counts.as_ref();
            let count = counts.map(|counts| counts.get(&id).copied().unwrap_or(0));
            topics.add_messages(topic, count);
            let entry = ChannelTopic {
                topic,
                name: channel.topic.clone(),
                promised: count.filter(|_| contents.counts_are_promised),
            };
            by_id.insert(id, entry);
        }
        Self { by_id }
    }
}

#[derive(Clone, Copy)]
enum Use {
    Undefined,
    Unwanted,
    Wanted(TopicId),
}

/// Channel numbers up to this are looked up in a table.
const TABLE_LIMIT: u32 = 1 << 16;

pub(super) struct Delivery<'d, 'r> {
    channels: &'d ChannelTable,
    chunks: &'d ChunkDirectory,
    request: &'d mut Request<'r>,
    uses: Vec<Use>,
    /// Messages seen of each channel in the table.
    seen: Vec<u64>,
}

impl<'d, 'r> Delivery<'d, 'r> {
    pub(super) fn new(
        channels: &'d ChannelTable,
        chunks: &'d ChunkDirectory,
        request: &'d mut Request<'r>,
    ) -> Self {
        let last_in_table = channels.by_id.range(..TABLE_LIMIT).next_back();
        let count = last_in_table.map_or(0, |(&id, _)| id as usize + 1);
        let mut delivery = Self {
            channels,
            chunks,
            request,
            uses: Vec::new(),
            seen: vec![0; count],
        };
        let uses = (0..count as u32).map(|id| delivery.look_up(id)).collect();
        delivery.uses = uses;
        delivery
    }

    fn look_up(&self, channel_id: u32) -> Use {
        match self.channels.by_id.get(&channel_id) {
            None => Use::Undefined,
            Some(entry) if self.request.wants(entry.topic) => Use::Wanted(entry.topic),
            Some(_) => Use::Unwanted,
        }
    }

    #[inline]
    fn channel_use(&self, channel_id: u32) -> Use {
        match self.uses.get(channel_id as usize) {
            Some(found) => *found,
            None => self.look_up(channel_id),
        }
    }

    /// Tells which messages the index counts that did not come.
    pub(super) fn report_missing(&self, losses: &mut Losses) {
        for (&id, entry) in &self.channels.by_id {
            let seen = self.seen.get(id as usize).copied();
            if let (Some(promised), Some(seen), true) =
                (entry.promised, seen, self.request.wants(entry.topic))
                && promised > seen
            {
                losses.miss(&entry.name, promised - seen);
            }
        }
    }
}

impl Visitor for Delivery<'_, '_> {
    fn wants_chunk(&self, offset: u64) -> bool {
        let channels = self.chunks.get(&offset).map(|entry| &entry.channels);
        match channels {
            Some(Some(channels)) => channels
                .iter()
                .any(|&channel| matches!(self.channel_use(channel), Use::Wanted(_))),
            _ => true,
        }
    }

    fn definition(&mut self, definition: &Definition<'_>) -> bool {
        // What the index told first, counts; the data may contradict it.
        match definition {
            Definition::Schema { .. } => true,
            Definition::Channel { id, channel } => {
                let known = self.channels.by_id.get(id);
                known.is_none_or(|known| known.name == channel.topic)
            }
        }
    }

    #[inline]
    fn message(&mut self, record: &MessageRecord<'_>) -> Next {
        let topic = match self.channel_use(record.channel_id) {
            Use::Wanted(topic) => topic,
            Use::Unwanted => return Next::Continue,
            Use::Undefined => return Next::UndefinedChannel,
        };
        if let Some(seen) = self.seen.get_mut(record.channel_id as usize) {
            *seen += 1;
        }
        let message = Message {
            topic,
            log_time_ns: record.log_time_ns,
            publish_time_ns: record.publish_time_ns,
            sequence: record.sequence,
            data: record.data,
        };
        match (self.request.visit)(&message) {
            ControlFlow::Continue(()) => Next::Continue,
            ControlFlow::Break(()) => Next::Stop,
        }
    }

    fn topic_name(&self, channel_id: u32) -> Option<&str> {
        let entry = self.channels.by_id.get(&channel_id);
        entry.map(|entry| entry.name.as_str())
    }

    fn progress(&mut self, offset: u64) {
        self.request.advance(offset);
    }
}
