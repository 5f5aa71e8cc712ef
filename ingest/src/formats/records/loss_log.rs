//! Records the losses of a walk, with their time spans and message counts.

use std::{collections::BTreeMap, ops::Range, path::Path};

use super::{
    contents::{ChunkDirectory, ChunkEntry},
    visitor::Visitor,
};
use crate::message::{Losses, LostPart, LostRange};

/// Collects losses along a walk.
pub(super) struct LossLog<'l> {
    file: &'l Path,
    chunks: &'l ChunkDirectory,
    ranges: Vec<LostRange>,
    /// Index of the first range that lacks the time of the first message after it.
    first_open: usize,
    /// The log time of the last intact message.
    last_time_ns: Option<i64>,
    /// The loss that the next index records describe.
    last_loss: Option<LastLoss>,
    /// Messages of the last chunk not yet covered by index records; `None` if it was not read.
    unindexed: Option<u64>,
}

struct LastLoss {
    place: usize,
    /// Messages that were recovered, by channel.
    found: BTreeMap<u32, u64>,
    /// Whether index records cover the whole loss: the loss is one chunk with an intact header.
    is_one_chunk: bool,
    has_index: bool,
    /// Lost messages of unknown channels.
    unnamed: u64,
}

impl<'l> LossLog<'l> {
    pub(super) fn new(file: &'l Path, chunks: &'l ChunkDirectory) -> Self {
        Self {
            file,
            chunks,
            ranges: Vec::new(),
            first_open: 0,
            last_time_ns: None,
            last_loss: None,
            unindexed: Some(0),
        }
    }

    /// The log time of the last intact message.
    pub(super) fn last_time_ns(&self) -> Option<i64> {
        self.last_time_ns
    }

    /// Notes the times of intact messages.
    pub(super) fn pass(&mut self, first_ns: i64, last_ns: i64) {
        for range in self.ranges.get_mut(self.first_open..).unwrap_or_default() {
            range.last_time_ns.get_or_insert(first_ns);
        }
        self.first_open = self.ranges.len();
        self.last_time_ns = Some(last_ns);
    }

    /// Records a loss; `found` counts the messages recovered from it.
    ///
    /// Its times come from the index, else from the messages before and after. The header of a
    /// damaged chunk is not used, because no checksum covers it.
    pub(super) fn lose<V: Visitor>(
        &mut self,
        part: LostPart,
        bytes: Range<u64>,
        reason: String,
        found: BTreeMap<u32, u64>,
        visitor: &V,
    ) {
        let known = self.known_chunks(&bytes);
        // It is unknown how long the recording would have continued.
        let span_ns = spanned(&known).filter(|_| part != LostPart::Tail);
        let counts = counted(&known, &found, visitor);
        // Unreadable records may be index records of the previous chunk; the rest of them would
        // then count messages that were found.
        let is_of_this = part == LostPart::Chunk || !known.is_empty() || self.unindexed == Some(0);
        self.last_loss = (counts.is_none() && is_of_this).then_some(LastLoss {
            place: self.ranges.len(),
            found,
            is_one_chunk: part == LostPart::Chunk,
            has_index: false,
            unnamed: 0,
        });
        self.unindexed = None;
        let messages = counts.unwrap_or_default();
        self.ranges.push(LostRange {
            file: self.file.to_path_buf(),
            start_byte: bytes.start,
            end_byte: bytes.end,
            part,
            reason,
            first_time_ns: span_ns.map(|span| span.0).or(self.last_time_ns),
            last_time_ns: span_ns.map(|span| span.1),
            message_count: is_counted(&known).then(|| messages.values().sum()),
            messages,
        });
    }

    /// Notes a chunk that was read completely.
    pub(super) fn chunk(&mut self, messages: u64) {
        self.unindexed = Some(messages);
    }

    /// Notes an index record, which describes the loss before it, if any.
    pub(super) fn index<V: Visitor>(&mut self, channel_id: u32, count: u64, visitor: &V) {
        self.unindexed = self.unindexed.and_then(|left| left.checked_sub(count));
        let Some(loss) = &mut self.last_loss else {
            return;
        };
        let Some(range) = self.ranges.get_mut(loss.place) else {
            return;
        };
        let found = loss.found.get(&channel_id).copied().unwrap_or(0);
        let lost = count.saturating_sub(found);
        loss.has_index = true;
        match visitor.topic_name(channel_id) {
            Some(topic) if lost > 0 => {
                *range.messages.entry(topic.to_owned()).or_default() += lost;
            }
            Some(_) => {}
            None => loss.unnamed += lost,
        }
    }

    /// Ignores the index records that follow.
    pub(super) fn expect_no_indexes(&mut self) {
        self.last_loss = None;
    }

    /// Called where no further index record can follow. If there is damage instead, one may be
    /// missing, and no total is stated.
    pub(super) fn end_of_indexes(&mut self) {
        let complete = |loss: &LastLoss| loss.has_index && loss.is_one_chunk;
        if let Some(loss) = self.last_loss.take().filter(complete)
            && let Some(range) = self.ranges.get_mut(loss.place)
        {
            range.message_count = Some(range.messages.values().sum::<u64>() + loss.unnamed);
        }
    }

    pub(super) fn finish(mut self, losses: &mut Losses) {
        self.end_of_indexes();
        for range in self.ranges {
            losses.push(range);
        }
    }

    fn known_chunks(&self, bytes: &Range<u64>) -> Vec<&'l ChunkEntry> {
        if bytes.is_empty() {
            return Vec::new();
        }
        self.chunks
            .range(bytes.clone())
            .map(|(_, entry)| entry)
            .collect()
    }
}

fn spanned(chunks: &[&ChunkEntry]) -> Option<(i64, i64)> {
    let spans = chunks.iter().filter_map(|entry| entry.span_ns);
    spans.reduce(|all, one| (all.0.min(one.0), all.1.max(one.1)))
}

/// Whether an index counts the messages of these chunks.
fn is_counted(chunks: &[&ChunkEntry]) -> bool {
    !chunks.is_empty() && chunks.iter().all(|entry| !entry.counts.is_empty())
}

/// Messages of these chunks that were not recovered, by topic; `None` if no index counts them.
fn counted<V: Visitor>(
    chunks: &[&ChunkEntry],
    found: &BTreeMap<u32, u64>,
    visitor: &V,
) -> Option<BTreeMap<String, u64>> {
    let mut by_channel: BTreeMap<u32, u64> = BTreeMap::new();
    for (channel, count) in chunks.iter().flat_map(|entry| &entry.counts) {
        let sum = by_channel.entry(*channel).or_default();
        *sum = sum.saturating_add(*count);
    }
    let mut messages = BTreeMap::new();
    for (channel, count) in by_channel {
        let lost = count.saturating_sub(found.get(&channel).copied().unwrap_or(0));
        if let Some(topic) = visitor.topic_name(channel).filter(|_| lost > 0) {
            *messages.entry(topic.to_owned()).or_default() += lost;
        }
    }
    is_counted(chunks).then_some(messages)
}
