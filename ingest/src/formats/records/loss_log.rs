//! What a walk lost: between which times, and how many messages of which topics.

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
    /// The ranges from here on still wait for the first message after them.
    first_open: usize,
    /// The log time of the last intact message.
    last_time_ns: Option<i64>,
    /// What index records that come next tell about.
    last_loss: Option<LastLoss>,
    /// Messages of the last chunk that no index record has told of yet; `None` where it was not read.
    unindexed: Option<u64>,
}

struct LastLoss {
    place: usize,
    /// Messages that did come out, by channel.
    found: BTreeMap<u32, u64>,
    /// Index records tell of all that is lost: it is one chunk whose header is intact.
    is_one_chunk: bool,
    has_index: bool,
    /// Messages lost of channels that nobody knows.
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
        let counts = counted(&known, &found, visitor);
        // Records that cannot be read may be the indexes of the chunk before; those that are left of
        // them would then tell of messages that came.
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

    /// A chunk was read whole.
    pub(super) fn chunk(&mut self, messages: u64) {
        self.unindexed = Some(messages);
    }

    /// An index record: if a loss comes before it, it tells what was in there.
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

    /// The index records that follow do not tell about the loss before them.
    pub(super) fn expect_no_indexes(&mut self) {
        self.last_loss = None;
    }

    /// All index records of a chunk have come: a record stands where no more can follow. If there is
    /// damage instead, nobody knows whether one is missing, and no sum is claimed.
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

/// Messages by topic that these chunks had and that did not come out; `None` where no index counts them.
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
