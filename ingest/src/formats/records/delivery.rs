//! Delivers the wanted messages to the caller of [`Log::read`](crate::Log::read).

use std::ops::ControlFlow;

use super::{
    channel_counts::ChannelCounts,
    contents::ChunkDirectory,
    parsed::{DefinitionRecord, MessageRecord},
    routes::{ChannelUse, Routes},
    visitor::{Next, Visitor},
};
use crate::{
    formats::reader::{Batch, Request},
    message::Losses,
};

pub(super) struct Delivery<'d, 'r> {
    routes: &'d Routes<'d>,
    chunks: &'d ChunkDirectory,
    request: &'d mut Request<'r>,
    seen: ChannelCounts,
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
            seen: ChannelCounts::new(routes.table_size()),
        }
    }

    /// Reports the messages that the index counts but that were not found.
    pub(super) fn report_missing(&self, losses: &mut Losses) {
        for (&id, entry) in &self.routes.channels.by_id {
            let seen = self.seen.0.get(id as usize).copied();
            if let (Some(indexed_count), Some(seen), true) =
                (entry.indexed_count, seen, self.routes.wants(entry.topic))
                && indexed_count > seen
            {
                losses.miss(&entry.name, indexed_count - seen);
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
                .any(|&channel| matches!(self.routes.channel_use(channel), ChannelUse::Wanted(..))),
            _ => true,
        }
    }

    fn definition(&mut self, definition: &DefinitionRecord<'_>) -> bool {
        self.routes.agrees(definition)
    }

    #[inline]
    fn message(&mut self, record: &MessageRecord<'_>) -> Next {
        let (topic, writer) = match self.routes.wanted_topic(record.channel_id) {
            Ok(topic) => topic,
            Err(next) => return next,
        };
        self.seen.add(record.channel_id, 1);
        match (self.request.visit)(&record.message(topic, writer)) {
            ControlFlow::Continue(()) => Next::Continue,
            ControlFlow::Break(()) => Next::Stop,
        }
    }

    fn accept(&mut self, batch: &mut dyn Batch, counts: &mut ChannelCounts) {
        batch.deliver();
        if let Some(batches) = &self.request.batches {
            (batches.delivered)();
        }
        for (id, messages) in counts.0.iter_mut().enumerate() {
            let messages = std::mem::take(messages);
            let id = id as u32;
            self.seen.add(id, messages);
            if let (ChannelUse::Wanted(topic, _), Some(batches)) =
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
