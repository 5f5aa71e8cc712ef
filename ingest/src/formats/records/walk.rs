//! One pass over the records of a file. Every length is checked before it is followed.
//!
//! After an invalid record, the walk resumes at the next offset where a record certainly begins: a
//! chunk of the index, or one found by a search of every byte.

use std::{
    collections::BTreeMap,
    marker::PhantomData,
    ops::{Bound, ControlFlow, Range},
};

use tipwatch_language::{say, word};

use super::{
    contents::ChunkDirectory,
    grammar::{Frame, Grammar, Kind},
    head_window::{HeadWindow, SMALLEST_WINDOW_BYTES},
    intake::Intake,
    loss_log::LossLog,
    parsed::MessageRecord,
    read_ahead::{Chunks, KeptChunk, with_chunks},
    row::Tally,
    unpacked::Unpacked,
    visitor::{Next, Visitor},
};
use crate::{
    file::FileBytes,
    message::{Error, Losses, LostPart},
};

/// Largest record that is read into memory.
pub(super) const RECORD_LIMIT_BYTES: u64 = 1 << 30;

/// Walks the messages of a file from its beginning. Verified chunks go through the intake, if there
/// is one, as they are decompressed. The chunk in which a walk is stopped is kept for the next one.
pub(super) fn walk<G: Grammar, V: Visitor>(
    file: &FileBytes,
    chunks: &ChunkDirectory,
    is_empty: bool,
    intake: Option<&Intake<'_>>,
    kept: &KeptChunk,
    visitor: &mut V,
    losses: &mut Losses,
) -> Result<ControlFlow<()>, Error> {
    let by_index = file.is_partial() && !chunks.is_empty();
    if by_index {
        file.plan(wanted_ranges(file, chunks, visitor));
    }
    with_chunks(file, intake, kept, |unpacking| {
        Walk::<G, V> {
            by_index,
            is_empty,
            file,
            chunks,
            visitor,
            unpacking,
            window: HeadWindow::new(file),
            log: LossLog::new(file.path(), chunks),
            loose: Tally::default(),
            loose_range: 0..0,
            loose_problems: 0,
            checksums: (false, false),
            passed_over: 0,
            is_past_messages: false,
            grammar: PhantomData,
        }
        .run(losses)
    })
}

pub(super) struct Walk<'w, G, V> {
    pub(super) file: &'w FileBytes,
    pub(super) chunks: &'w ChunkDirectory,
    pub(super) visitor: &'w mut V,
    pub(super) unpacking: Chunks<'w, G>,
    pub(super) window: HeadWindow<'w>,
    pub(super) log: LossLog<'w>,
    /// Problems with records outside chunks.
    pub(super) loose: Tally,
    pub(super) loose_range: Range<u64>,
    pub(super) loose_problems: u64,
    /// Whether any checksum was present, and whether any was absent.
    pub(super) checksums: (bool, bool),
    /// Chunks that the visitor did not want.
    pub(super) passed_over: u64,
    /// Whether only repeated definitions follow: damage there loses no message.
    pub(super) is_past_messages: bool,
    /// Whether the walk visits only wanted chunks, because the rest is in a bucket.
    pub(super) by_index: bool,
    /// Whether the index states that nothing was recorded: then no record marks the end.
    pub(super) is_empty: bool,
    pub(super) grammar: PhantomData<G>,
}

/// The ranges of a file that a walk by its index reads.
fn wanted_ranges<V: Visitor>(
    file: &FileBytes,
    chunks: &ChunkDirectory,
    visitor: &V,
) -> Vec<Range<u64>> {
    let ends = chunks.keys().skip(1).copied().chain([file.len()]);
    let ranges = chunks.iter().zip(ends).map(|((&offset, entry), next)| {
        let end = entry
            .length_bytes
            .map_or(next, |length| offset.saturating_add(length));
        // with the head of what follows, where the walk looks whether a record begins
        offset..end.saturating_add(SMALLEST_WINDOW_BYTES).min(file.len())
    });
    ranges
        .filter(|range| visitor.wants_chunk(range.start))
        .collect()
}

/// Content of the file at an offset.
enum AtOffset {
    Record(Frame),
    End,
    /// The file ends without an end mark.
    Unclosed,
    Damaged(String),
}

impl<G: Grammar, V: Visitor> Walk<'_, G, V> {
    fn run(mut self, losses: &mut Losses) -> Result<ControlFlow<()>, Error> {
        let flow = self.records()?;
        self.log.end_of_indexes();
        if let Some(reason) = self.loose.reason() {
            let range = self.loose_range.clone();
            self.lose(LostPart::Records, range, reason);
        }
        self.log.finish(losses);
        losses.integrity.checksums_present |= self.checksums.0;
        losses.integrity.checksums_absent |= self.checksums.1;
        losses.integrity.chunks_passed_over += self.passed_over;
        Ok(flow)
    }

    fn records(&mut self) -> Result<ControlFlow<()>, Error> {
        let mut offset = G::FIRST_RECORD;
        loop {
            if self.by_index {
                match self.next_wanted(offset) {
                    Some(next) => offset = next,
                    None => return Ok(ControlFlow::Continue(())),
                }
            }
            match self.record_at(offset)? {
                AtOffset::Record(frame) if self.by_index && frame.kind != Kind::Chunk => {
                    let reason = word!("expected a chunk, as the index states").to_owned();
                    match self.damaged(offset, reason)? {
                        Resumption::Resume(next) => offset = next,
                        Resumption::Stop(flow) => return Ok(flow),
                    }
                }
                AtOffset::Record(frame) if frame.kind == Kind::End => {
                    if !self.visitor.wants_repetitions() {
                        return Ok(ControlFlow::Continue(()));
                    }
                    self.is_past_messages = true;
                    offset += frame.length_bytes;
                }
                AtOffset::Record(frame) => {
                    let end = offset + frame.length_bytes;
                    if self.record(&frame, offset..end)?.is_break() {
                        return Ok(ControlFlow::Break(()));
                    }
                    offset = end;
                }
                AtOffset::End => return Ok(ControlFlow::Continue(())),
                AtOffset::Unclosed if self.is_empty => return Ok(ControlFlow::Continue(())),
                AtOffset::Unclosed => {
                    let reason =
                        word!("the recording was not closed: later messages may be missing");
                    self.lose(LostPart::Tail, offset..offset, reason.to_owned());
                    return Ok(ControlFlow::Continue(()));
                }
                AtOffset::Damaged(reason) => match self.damaged(offset, reason)? {
                    Resumption::Resume(next) => offset = next,
                    Resumption::Stop(flow) => return Ok(flow),
                },
            }
        }
    }

    /// The next wanted chunk of the index.
    fn next_wanted(&mut self, offset: u64) -> Option<u64> {
        for (&chunk, _) in self.chunks.range(offset..) {
            if self.visitor.wants_chunk(chunk) {
                return Some(chunk);
            }
            self.passed_over += 1;
        }
        None
    }

    fn record_at(&mut self, offset: u64) -> Result<AtOffset, Error> {
        let remaining = self.file.len().saturating_sub(offset);
        let head = self.window.bytes(offset, G::HEAD_BYTES as u64)?;
        if remaining == 0 {
            return Ok(AtOffset::Unclosed);
        }
        if head.len() as u64 == remaining && G::is_closing(head) {
            return Ok(AtOffset::End);
        }
        let Some(frame) = G::frame(head) else {
            return Ok(AtOffset::Damaged(G::complaint(head)));
        };
        let length_bytes = frame.length_bytes;
        let is_read = matches!(frame.kind, Kind::Chunk | Kind::Message | Kind::Definition);
        if length_bytes > remaining {
            return Ok(AtOffset::Damaged(say!(
                "a record of {length_bytes} bytes, but only {remaining} bytes are left in the file"
            )));
        }
        if is_read && length_bytes > RECORD_LIMIT_BYTES {
            let reason = say!("a record of {length_bytes} bytes is implausible");
            return Ok(AtOffset::Damaged(reason));
        }
        let end = offset + length_bytes;
        if self.next_known_chunk(offset).is_some_and(|next| next < end) {
            let reason = say!("a record of {length_bytes} bytes overlaps a chunk");
            return Ok(AtOffset::Damaged(reason));
        }
        if !self.is_boundary(end)? {
            let within = self.within(offset)?;
            if self.search(offset + 1, end, within)?.is_some() {
                let reason = say!("another record begins inside a record of {length_bytes} bytes");
                return Ok(AtOffset::Damaged(reason));
            }
        }
        Ok(AtOffset::Record(frame))
    }

    pub(super) fn next_known_chunk(&self, offset: u64) -> Option<u64> {
        let after = (Bound::Excluded(offset), Bound::Unbounded);
        self.chunks.range(after).next().map(|(&next, _)| next)
    }

    /// Whether a record or the end of the file is at an offset.
    pub(super) fn is_boundary(&mut self, offset: u64) -> Result<bool, Error> {
        let remaining = self.file.len().saturating_sub(offset);
        let head = self.window.bytes(offset, G::HEAD_BYTES as u64)?;
        let is_end = head.len() as u64 == remaining && (head.is_empty() || G::is_closing(head));
        let is_record = |frame: Frame| {
            frame.kind != Kind::Unknown && frame.length_bytes <= remaining && remaining > 0
        };
        Ok(is_end || G::frame(head).is_some_and(is_record))
    }

    fn record(&mut self, frame: &Frame, bytes: Range<u64>) -> Result<ControlFlow<()>, Error> {
        match frame.kind {
            Kind::Chunk => {
                let flow = self.chunk(&bytes, frame.is_unmistakable)?;
                self.visitor.progress(bytes.end);
                return Ok(flow);
            }
            kind @ (Kind::Message | Kind::Definition) => return self.loose_record(kind, bytes),
            Kind::Index => self.index(&bytes)?,
            Kind::Unknown => {
                let reason = word!("a record of an undefined kind");
                self.lose(LostPart::Records, bytes, reason.to_owned());
            }
            Kind::Other => self.visitor.other(&bytes),
            Kind::End => {}
        }
        Ok(ControlFlow::Continue(()))
    }

    fn index(&mut self, bytes: &Range<u64>) -> Result<(), Error> {
        let head = self.window.bytes(bytes.start, G::HEAD_BYTES as u64)?;
        if let Some((channel, count)) = G::index(head) {
            self.log.index(channel, count, self.visitor);
        }
        Ok(())
    }

    /// A chunk. If its length is not certain, bytes behind its data may belong to the data: a length inside is wrong.
    fn chunk(&mut self, bytes: &Range<u64>, is_certain: bool) -> Result<ControlFlow<()>, Error> {
        self.log.end_of_indexes();
        if !self.visitor.wants_chunk(bytes.start) {
            self.passed_over += 1;
            return Ok(ControlFlow::Continue(()));
        }
        self.visitor.begin_chunk(bytes.start, bytes.end);
        let mut unpacked = self.unpacking.take(bytes, self.visitor)?;
        if unpacked.failure.is_some() && unpacked.has_checksum && !is_certain {
            let reason = word!("a chunk that is longer than its fields");
            if let Some(mended) = self.mended_chunk(bytes.start, Some(bytes.end), reason)? {
                self.unpacking.give_back(unpacked);
                return Ok(match mended {
                    Resumption::Stop(flow) => flow,
                    Resumption::Resume(_) => ControlFlow::Continue(()),
                });
            }
        }
        let flow = self.content(&mut unpacked, bytes, LostPart::Chunk, None);
        match flow {
            ControlFlow::Continue(()) => self.unpacking.give_back(unpacked),
            ControlFlow::Break(()) => self.unpacking.keep(bytes, unpacked),
        }
        Ok(flow)
    }

    /// Walks the content of a chunk and reports problems, starting with `beforehand`.
    pub(super) fn content(
        &mut self,
        unpacked: &mut Unpacked,
        bytes: &Range<u64>,
        part: LostPart,
        beforehand: Option<String>,
    ) -> ControlFlow<()> {
        if let Some(reason) = &unpacked.failure {
            let reason = reason.clone();
            self.lose(part, bytes.clone(), reason);
            return ControlFlow::Continue(());
        }
        let is_verified = unpacked.has_checksum && part != LostPart::Tail;
        self.checksums.0 |= is_verified;
        self.checksums.1 |= !is_verified;
        let (tally, flow) = self.messages(unpacked, is_verified);
        if let Some((first_ns, last_ns)) = tally.span_ns {
            self.log.pass(first_ns, last_ns);
        }
        let mut reasons: Vec<String> = beforehand.into_iter().chain(tally.reason()).collect();
        if part == LostPart::Tail && tally.messages > 0 {
            let count = tally.messages;
            reasons.push(say!(
                "the first {count} messages of this chunk were read, unverified"
            ));
        }
        if reasons.is_empty() {
            self.log.chunk(tally.messages);
        } else {
            let found = count::<G>(unpacked.content());
            let lost = lost_place(unpacked, bytes, &tally);
            let reason = reasons.join("; ");
            self.log.lose(part, lost, reason, found, self.visitor);
        }
        flow
    }

    /// Passes the messages of a chunk to the visitor, unless they are decoded already.
    fn messages(&mut self, unpacked: &mut Unpacked, is_verified: bool) -> (Tally, ControlFlow<()>) {
        if let Some(taken) = unpacked.taken_in() {
            return (taken.deliver(self.visitor), ControlFlow::Continue(()));
        }
        let mut tally = Tally::default();
        let content = unpacked.content();
        let flow = if is_verified {
            tally.walk_intact::<G, V>(content, self.visitor)
        } else {
            tally.walk_unverified::<G, V>(content, self.visitor)
        };
        (tally, flow)
    }

    /// A record outside chunks.
    fn loose_record(&mut self, kind: Kind, bytes: Range<u64>) -> Result<ControlFlow<()>, Error> {
        self.log.end_of_indexes();
        let record = self.window.bytes(bytes.start, bytes.end - bytes.start)?;
        self.loose.span_ns = None;
        let flow = self.loose.record::<G, V>(kind, record, self.visitor);
        if let Some((first_ns, last_ns)) = self.loose.span_ns {
            self.log.pass(first_ns, last_ns);
        }
        self.checksums.1 |= kind == Kind::Message;
        let problems = self.loose.problems();
        if problems != self.loose_problems {
            let start = match self.loose_problems {
                0 => bytes.start,
                _ => self.loose_range.start,
            };
            self.loose_range = start..bytes.end;
            self.loose_problems = problems;
        }
        Ok(flow)
    }

    pub(super) fn lose(&mut self, part: LostPart, bytes: Range<u64>, reason: String) {
        if self.is_past_messages {
            return;
        }
        let nothing = BTreeMap::new();
        self.log.lose(part, bytes, reason, nothing, self.visitor);
    }
}

/// Returns the range of the damage in the file; exact if the content is not compressed.
fn lost_place(unpacked: &Unpacked, bytes: &Range<u64>, tally: &Tally) -> Range<u64> {
    let gaps = tally.gaps();
    match (unpacked.place_in_record(), gaps.first(), gaps.last()) {
        (Some(place), Some(first), Some(last)) => {
            let base = bytes.start + place as u64;
            base + first.start as u64..base + last.end as u64
        }
        _ => bytes.clone(),
    }
}

/// Message counts of a chunk by channel.
fn count<G: Grammar>(content: &[u8]) -> BTreeMap<u32, u64> {
    let mut counter = Counter::default();
    // A counter never stops the walk.
    let _ = Tally::default().walk_unverified::<G, _>(content, &mut counter);
    counter.0
}

#[derive(Default)]
struct Counter(BTreeMap<u32, u64>);

impl Visitor for Counter {
    fn message(&mut self, record: &MessageRecord<'_>) -> Next {
        *self.0.entry(record.channel_id).or_default() += 1;
        Next::Continue
    }

    fn topic_name(&self, _channel_id: u32) -> Option<&str> {
        None
    }
}

/// Content that a search may find.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum SearchScope {
    Anything,
    /// After the header of a chunk with a checksum over its content: its messages must not be found
    /// one by one.
    CheckedChunk,
}

/// Way to proceed after damage.
pub(super) enum Resumption {
    Resume(u64),
    Stop(ControlFlow<()>),
}
