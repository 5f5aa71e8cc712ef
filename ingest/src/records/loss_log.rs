//! What a walk lost: between which times, and how many messages of which topics.

use std::{collections::BTreeMap, ops::Range, path::Path};

use super::{ChunkDirectory, ChunkEntry, Visitor};
use crate::losses::{Losses, LostPart, LostRange};

/// Collects losses along a walk.
pub(super) struct LossLog<'l> {
    file: &'l Path,
    chunks: &'l ChunkDirectory,
    ranges: Vec<LostRange>,
    /// The ranges from here on still wait for the first message after them.
    first_open: usize,
    /// The log time of the last intact message.
    last_time_ns: Option<i64>,
    /// What index records that come next tell about.
    last_loss: Option<LastLoss>,
}

struct LastLoss {
    place: usize,
    /// Messages that did come out, by channel.
    found: BTreeMap<u32, u64>,
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
        }
    }

    /// The log time of the last intact message.
    pub(super) fn last_time_ns(&self) -> Option<i64> {
        self.last_time_ns
    }

    /// Intact messages went by.
    pub(super) fn pass(&mut self, first_ns: i64, last_ns: i64) {
        for range in self.ranges.get_mut(self.first_open..).unwrap_or_default() {
            range.last_time_ns.get_or_insert(first_ns);
        }
        self.first_open = self.ranges.len();
        self.last_time_ns = Some(last_ns);
    }

    /// Notes a loss; `found` is what came out of the record all the same.
    ///
    /// Its times are those that an index tells, else those of the messages before and after. The
    /// header of a damaged chunk is not believed: no checksum covers it.
    pub(super) fn lose<V: Visitor>(
        &mut self,
        part: LostPart,
        bytes: Range<u64>,
        reason: String,
        found: BTreeMap<u32, u64>,
        visitor: &V,
    ) {
        let known = self.known_chunks(&bytes);
        // Nobody knows how long a recording would have gone on.
        let span_ns = spanned(&known).filter(|_| part != LostPart::Tail);
        let messages = counted(&known, &found, visitor);
        let counts_follow = messages.is_empty();
        self.ranges.push(LostRange {
            file: self.file.to_path_buf(),
            start_byte: bytes.start,
            end_byte: bytes.end,
            part,
            reason,
            first_time_ns: span_ns.map(|span| span.0).or(self.last_time_ns),
            last_time_ns: span_ns.map(|span| span.1),
            messages,
        });
        let place = self.ranges.len() - 1;
        self.last_loss = counts_follow.then_some(LastLoss { place, found });
    }

    /// An index record: if a loss comes before it, it tells what was in there.
    pub(super) fn index<V: Visitor>(&mut self, channel_id: u32, count: u64, visitor: &V) {
        let Some(LastLoss { place, found }) = &self.last_loss else {
            return;
        };
        let lost = count.saturating_sub(found.get(&channel_id).copied().unwrap_or(0));
        let (Some(range), Some(topic)) =
            (self.ranges.get_mut(*place), visitor.topic_name(channel_id))
        else {
            return;
        };
        if lost > 0 {
            *range.messages.entry(topic.to_owned()).or_default() += lost;
        }
    }

    /// A record that ends what index records could tell about.
    pub(super) fn end_of_indexes(&mut self) {
        self.last_loss = None;
    }

    pub(super) fn finish(self, losses: &mut Losses) {
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

fn counted<V: Visitor>(
    chunks: &[&ChunkEntry],
    found: &BTreeMap<u32, u64>,
    visitor: &V,
) -> BTreeMap<String, u64> {
    let mut messages = BTreeMap::new();
    for (channel, count) in chunks.iter().flat_map(|entry| &entry.counts) {
        let lost = count.saturating_sub(found.get(channel).copied().unwrap_or(0));
        if let Some(topic) = visitor.topic_name(*channel).filter(|_| lost > 0) {
            *messages.entry(topic.to_owned()).or_default() += lost;
        }
    }
    messages
}
