//! Hands the wanted messages of a walk to the caller of [`Log::read`](crate::Log::read).

use std::{collections::BTreeMap, ops::ControlFlow};

use super::{
    ChunkDirectory, Contents, Definition, Grammar, MessageRecord, Next, Visitor, row::Tally,
};
use crate::{
    losses::Losses,
    message::Message,
    reader::{Batch, Request},
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

/// Which messages are wanted, by channel. The same on every thread.
pub(super) struct Routes<'d> {
    channels: &'d ChannelTable,
    wanted: &'d [bool],
    uses: Vec<Use>,
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

    fn wants(&self, topic: TopicId) -> bool {
        self.wanted.get(topic.index()).copied().unwrap_or(false)
    }

    fn look_up(&self, channel_id: u32) -> Use {
        match self.channels.by_id.get(&channel_id) {
            None => Use::Undefined,
            Some(entry) if self.wants(entry.topic) => Use::Wanted(entry.topic),
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

    /// Whether a definition agrees with what the index told, which counts.
    fn agrees(&self, definition: &Definition<'_>) -> bool {
        match definition {
            Definition::Schema { .. } => true,
            Definition::Channel { id, channel } => {
                let known = self.channels.by_id.get(id);
                known.is_none_or(|known| known.name == channel.topic)
            }
        }
    }

    fn topic_name(&self, channel_id: u32) -> Option<&str> {
        let entry = self.channels.by_id.get(&channel_id);
        entry.map(|entry| entry.name.as_str())
    }
}

/// Counts messages by channel.
struct Counts(Vec<u64>);

impl Counts {
    fn new(routes: &Routes<'_>) -> Self {
        Self(vec![0; routes.uses.len()])
    }

    #[inline]
    fn add(&mut self, channel_id: u32, messages: u64) {
        if let Some(count) = self.0.get_mut(channel_id as usize) {
            *count += messages;
        }
    }
}

pub(super) struct Delivery<'d, 'r> {
    routes: &'d Routes<'d>,
    chunks: &'d ChunkDirectory,
    request: &'d mut Request<'r>,
    seen: Counts,
}

impl<'d, 'r> Delivery<'d, 'r> {
    pub(super) fn new(
        routes: &'d Routes<'d>,
        chunks: &'d ChunkDirectory,
        request: &'d mut Request<'r>,
    ) -> Self {
        Self {
            routes,
            chunks,
            request,
            seen: Counts::new(routes),
        }
    }

    /// Tells which messages the index counts that did not come.
    pub(super) fn report_missing(&self, losses: &mut Losses) {
        for (&id, entry) in &self.routes.channels.by_id {
            let seen = self.seen.0.get(id as usize).copied();
            if let (Some(promised), Some(seen), true) =
                (entry.promised, seen, self.routes.wants(entry.topic))
                && promised > seen
            {
                losses.miss(&entry.name, promised - seen);
            }
        }
    }
}

fn message_of<'a>(topic: TopicId, record: &MessageRecord<'a>) -> Message<'a> {
    Message {
        topic,
        log_time_ns: record.log_time_ns,
        publish_time_ns: record.publish_time_ns,
        sequence: record.sequence,
        data: record.data,
    }
}

impl Visitor for Delivery<'_, '_> {
    fn wants_chunk(&self, offset: u64) -> bool {
        let channels = self.chunks.get(&offset).map(|entry| &entry.channels);
        match channels {
            Some(Some(channels)) => channels
                .iter()
                .any(|&channel| matches!(self.routes.channel_use(channel), Use::Wanted(_))),
            _ => true,
        }
    }

    fn definition(&mut self, definition: &Definition<'_>) -> bool {
        self.routes.agrees(definition)
    }

    #[inline]
    fn message(&mut self, record: &MessageRecord<'_>) -> Next {
        let topic = match self.routes.channel_use(record.channel_id) {
            Use::Wanted(topic) => topic,
            Use::Unwanted => return Next::Continue,
            Use::Undefined => return Next::UndefinedChannel,
        };
        self.seen.add(record.channel_id, 1);
        match (self.request.visit)(&message_of(topic, record)) {
            ControlFlow::Continue(()) => Next::Continue,
            ControlFlow::Break(()) => Next::Stop,
        }
    }

    fn accept(&mut self, taken: &mut TakenIn) {
        taken.batch.deliver();
        for (id, messages) in taken.messages.0.iter_mut().enumerate() {
            let messages = std::mem::take(messages);
            let id = id as u32;
            self.seen.add(id, messages);
            if let (Use::Wanted(topic), Some(batches)) =
                (self.routes.channel_use(id), &self.request.batches)
                && messages > 0
            {
                (batches.came)(topic, messages);
            }
        }
    }

    fn topic_name(&self, channel_id: u32) -> Option<&str> {
        self.routes.topic_name(channel_id)
    }

    fn progress(&mut self, offset: u64) {
        self.request.advance(offset);
    }
}

/// Takes in chunks on any thread.
pub(super) struct Intake<'d> {
    routes: &'d Routes<'d>,
    empty: &'d (dyn Fn() -> Box<dyn Batch> + Sync),
}

/// The messages of one chunk, taken in; used again for another.
pub(crate) struct TakenIn {
    batch: Box<dyn Batch>,
    messages: Counts,
    /// What is wrong with the chunk.
    pub(super) tally: Tally,
}

impl<'d> Intake<'d> {
    pub(super) fn new(
        routes: &'d Routes<'d>,
        empty: &'d (dyn Fn() -> Box<dyn Batch> + Sync),
    ) -> Self {
        Self { routes, empty }
    }

    /// Takes in content that a checksum vouches for.
    pub(super) fn take_in<G: Grammar>(&self, content: &[u8], used: Option<TakenIn>) -> TakenIn {
        let mut taken = used.unwrap_or_else(|| TakenIn {
            batch: (self.empty)(),
            messages: Counts::new(self.routes),
            tally: Tally::default(),
        });
        taken.tally = Tally::default();
        let mut visitor = BatchVisitor {
            routes: self.routes,
            batch: &mut *taken.batch,
            messages: &mut taken.messages,
        };
        // A batch never stops by itself.
        let _ = taken.tally.walk_intact::<G, _>(content, &mut visitor);
        taken
    }
}

struct BatchVisitor<'b> {
    routes: &'b Routes<'b>,
    batch: &'b mut dyn Batch,
    messages: &'b mut Counts,
}

impl Visitor for BatchVisitor<'_> {
    fn definition(&mut self, definition: &Definition<'_>) -> bool {
        self.routes.agrees(definition)
    }

    #[inline]
    fn message(&mut self, record: &MessageRecord<'_>) -> Next {
        let topic = match self.routes.channel_use(record.channel_id) {
            Use::Wanted(topic) => topic,
            Use::Unwanted => return Next::Continue,
            Use::Undefined => return Next::UndefinedChannel,
        };
        self.messages.add(record.channel_id, 1);
        self.batch.take(&message_of(topic, record));
        Next::Continue
    }

    fn topic_name(&self, channel_id: u32) -> Option<&str> {
        self.routes.topic_name(channel_id)
    }
}
