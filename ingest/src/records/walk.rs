//! One pass over the records of a file. Every length is checked before it is followed.
//!
//! Where a record cannot be followed, the walk goes on at the next place where a record certainly
//! begins: a chunk that the index knows, or one found by looking at every byte.

use std::{
    collections::BTreeMap,
    marker::PhantomData,
    ops::{Bound, ControlFlow, Range},
};

use super::{
    ChunkDirectory, Compression, Definition, Frame, Grammar, HeadWindow, Kind, MessageRecord, Next,
    Visitor,
    loss_log::LossLog,
    read_ahead::{Chunks, How, Unpacked, with_chunks},
    row::Tally,
};
use crate::{
    error::Error,
    file_bytes::FileBytes,
    losses::{Losses, LostPart},
};

/// What is read at once; other records may be larger, they are passed over.
const RECORD_LIMIT_BYTES: u64 = 1 << 30;
/// How many bytes are looked at at once in search of the next record.
const SEARCH_BYTES: u64 = 256 << 10;

/// Walks the messages of a file from its beginning.
pub(super) fn walk<G: Grammar, V: Visitor>(
    file: &FileBytes,
    chunks: &ChunkDirectory,
    visitor: &mut V,
    losses: &mut Losses,
) -> Result<ControlFlow<()>, Error> {
    with_chunks(file, |unpacking| {
        Walk::<G, V> {
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
            is_past_messages: false,
            grammar: PhantomData,
        }
        .run(losses)
    })
}

struct Walk<'w, G, V> {
    file: &'w FileBytes,
    chunks: &'w ChunkDirectory,
    visitor: &'w mut V,
    unpacking: Chunks<'w, G>,
    window: HeadWindow<'w>,
    log: LossLog<'w>,
    /// What went wrong with single records outside chunks.
    loose: Tally,
    loose_range: Range<u64>,
    loose_problems: u64,
    /// Whether one was present, whether one was absent.
    checksums: (bool, bool),
    /// Whether only repetitions follow: their damage costs no message.
    is_past_messages: bool,
    grammar: PhantomData<G>,
}

/// What stands at an offset.
enum Place {
    Record(Frame),
    End,
    /// Nothing follows, not even an end mark.
    Unclosed,
    Damaged(String),
}

/// Where a record is searched.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Within {
    Anything,
    /// Behind the header of a chunk whose checksum decides over all that is in it. Its messages are
    /// not to be found one by one.
    CheckedChunk,
}

impl Within {
    fn may_hold(self, kind: Kind) -> bool {
        self == Self::Anything || !matches!(kind, Kind::Message | Kind::Definition)
    }
}

/// How to go on after damage.
enum After {
    Resume(u64),
    Stop(ControlFlow<()>),
}

impl<G: Grammar, V: Visitor> Walk<'_, G, V> {
    fn run(mut self, losses: &mut Losses) -> Result<ControlFlow<()>, Error> {
        let flow = self.records()?;
        if let Some(reason) = self.loose.reason() {
            let range = self.loose_range.clone();
            self.lose(LostPart::Records, range, reason);
        }
        self.log.finish(losses);
        losses.integrity.checksums_present |= self.checksums.0;
        losses.integrity.checksums_absent |= self.checksums.1;
        Ok(flow)
    }

    fn records(&mut self) -> Result<ControlFlow<()>, Error> {
        let mut offset = G::FIRST_RECORD;
        loop {
            match self.place_at(offset)? {
                Place::Record(frame) if frame.kind == Kind::End => {
                    if !self.visitor.wants_repetitions() {
                        return Ok(ControlFlow::Continue(()));
                    }
                    self.is_past_messages = true;
                    offset += frame.length_bytes;
                }
                Place::Record(frame) => {
                    let end = offset + frame.length_bytes;
                    if self.record(frame.kind, offset..end)?.is_break() {
                        return Ok(ControlFlow::Break(()));
                    }
                    offset = end;
                }
                Place::End => return Ok(ControlFlow::Continue(())),
                Place::Unclosed => {
                    let reason = "the recording was not closed: what would follow is unknown";
                    self.lose(LostPart::Tail, offset..offset, reason.to_owned());
                    return Ok(ControlFlow::Continue(()));
                }
                Place::Damaged(reason) => match self.damaged(offset, reason)? {
                    After::Resume(next) => offset = next,
                    After::Stop(flow) => return Ok(flow),
                },
            }
        }
    }

    fn place_at(&mut self, offset: u64) -> Result<Place, Error> {
        let remaining = self.file.len().saturating_sub(offset);
        let head = self.window.bytes(offset, G::HEAD_BYTES as u64)?;
        if remaining == 0 {
            return Ok(Place::Unclosed);
        }
        if head.len() as u64 == remaining && G::is_closing(head) {
            return Ok(Place::End);
        }
        let Some(frame) = G::frame(head) else {
            return Ok(Place::Damaged(G::complaint(head)));
        };
        let length_bytes = frame.length_bytes;
        let is_read = matches!(frame.kind, Kind::Chunk | Kind::Message | Kind::Definition);
        if length_bytes > remaining {
            return Ok(Place::Damaged(format!(
                "a record of {length_bytes} bytes, but the file ends after {remaining} bytes"
            )));
        }
        if is_read && length_bytes > RECORD_LIMIT_BYTES {
            let reason = format!("a record of implausible {length_bytes} bytes");
            return Ok(Place::Damaged(reason));
        }
        let end = offset + length_bytes;
        if self.next_known_chunk(offset).is_some_and(|next| next < end) {
            let reason = format!("a record of {length_bytes} bytes runs into a chunk");
            return Ok(Place::Damaged(reason));
        }
        if !self.is_place(end)? {
            let within = self.within(offset)?;
            if self.search(offset + 1, end, within)?.is_some() {
                let reason = format!("another record begins within one of {length_bytes} bytes");
                return Ok(Place::Damaged(reason));
            }
        }
        Ok(Place::Record(frame))
    }

    /// What may be searched behind the first byte of the record at `offset`.
    fn within(&mut self, offset: u64) -> Result<Within, Error> {
        let head = self.window.bytes(offset, G::HEAD_BYTES as u64)?;
        let is_chunk = G::frame(head).is_some_and(|frame| frame.kind == Kind::Chunk);
        let is_checked = is_chunk && G::chunk(head).is_some_and(|chunk| chunk.has_checksum());
        Ok(match is_checked {
            true => Within::CheckedChunk,
            false => Within::Anything,
        })
    }

    fn next_known_chunk(&self, offset: u64) -> Option<u64> {
        let after = (Bound::Excluded(offset), Bound::Unbounded);
        self.chunks.range(after).next().map(|(&next, _)| next)
    }

    /// Whether a record or the end of the file stands at an offset.
    fn is_place(&mut self, offset: u64) -> Result<bool, Error> {
        let remaining = self.file.len().saturating_sub(offset);
        let head = self.window.bytes(offset, G::HEAD_BYTES as u64)?;
        let is_end = head.len() as u64 == remaining && (head.is_empty() || G::is_closing(head));
        let is_record = |frame: Frame| {
            frame.kind != Kind::Unknown && frame.length_bytes <= remaining && remaining > 0
        };
        Ok(is_end || G::frame(head).is_some_and(is_record))
    }

    fn record(&mut self, kind: Kind, bytes: Range<u64>) -> Result<ControlFlow<()>, Error> {
        match kind {
            Kind::Chunk => {
                let flow = self.chunk(&bytes)?;
                self.visitor.progress(bytes.end);
                return Ok(flow);
            }
            Kind::Message | Kind::Definition => return self.loose_record(kind, bytes),
            Kind::Index => self.index(&bytes)?,
            Kind::Unknown => {
                let reason = "a record of a kind that the format does not define";
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

    fn chunk(&mut self, bytes: &Range<u64>) -> Result<ControlFlow<()>, Error> {
        self.log.end_of_indexes();
        if !self.visitor.wants_chunk(bytes.start) {
            return Ok(ControlFlow::Continue(()));
        }
        self.visitor.begin_chunk(bytes.start, bytes.end);
        let unpacked = self.unpacking.take(bytes, self.visitor)?;
        let flow = self.content(&unpacked, bytes, LostPart::Chunk, None);
        self.unpacking.give_back(unpacked);
        Ok(flow)
    }

    /// Walks the content of a chunk, and reports what is wrong with it after `beforehand`.
    fn content(
        &mut self,
        unpacked: &Unpacked,
        bytes: &Range<u64>,
        part: LostPart,
        beforehand: Option<String>,
    ) -> ControlFlow<()> {
        if let Some(reason) = &unpacked.failure {
            let reason = reason.clone();
            self.lose(part, bytes.clone(), reason);
            return ControlFlow::Continue(());
        }
        let content = unpacked.content();
        let has_checksum = unpacked.header.is_some_and(|header| header.has_checksum);
        let is_verified = has_checksum && part != LostPart::Tail;
        self.checksums.0 |= is_verified;
        self.checksums.1 |= !is_verified;
        let mut tally = Tally::default();
        let flow = if is_verified {
            tally.walk_intact::<G, V>(content, self.visitor)
        } else {
            tally.walk_unverified::<G, V>(content, self.visitor)
        };
        if let Some((first_ns, last_ns)) = tally.span_ns {
            self.log.pass(first_ns, last_ns);
        }
        let mut reasons: Vec<String> = beforehand.into_iter().chain(tally.reason()).collect();
        if part == LostPart::Tail && tally.messages > 0 {
            let count = tally.messages;
            reasons.push(format!(
                "the first {count} messages of this chunk were read, unverified"
            ));
        }
        if !reasons.is_empty() {
            let found = count::<G>(content);
            let lost = lost_place(unpacked, bytes, &tally);
            let reason = reasons.join("; ");
            self.log.lose(part, lost, reason, found, self.visitor);
        }
        flow
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

    /// Something at `offset` that cannot be followed: perhaps a chunk whose header is damaged, or
    /// that the end of the file cuts; else the way to the next record is lost.
    fn damaged(&mut self, offset: u64, reason: String) -> Result<After, Error> {
        let file_bytes = self.file.len();
        let head = self.window.bytes(offset, G::HEAD_BYTES as u64)?;
        let is_cut = G::frame(head).is_some_and(|frame| {
            let end = offset.saturating_add(frame.length_bytes);
            frame.kind == Kind::Chunk && frame.is_certain && end > file_bytes
        });
        if is_cut {
            return self.tail(offset, reason).map(After::Stop);
        }
        let known = self.next_known_chunk(offset);
        let within = self.within(offset)?;
        let found = self.search(offset + 1, known.unwrap_or(file_bytes), within)?;
        let next = found.or(known);
        if let Some(after) = self.mended_chunk(offset, next, &reason)? {
            return Ok(after);
        }
        if let Some(next) = next {
            self.lose(LostPart::Records, offset..next, reason);
            return Ok(After::Resume(next));
        }
        self.tail(offset, reason).map(After::Stop)
    }

    /// A chunk whose kind or length is damaged, if its own checksum vouches for its content.
    fn mended_chunk(
        &mut self,
        offset: u64,
        next: Option<u64>,
        reason: &str,
    ) -> Result<Option<After>, Error> {
        let until = next.unwrap_or(self.file.len());
        let head = self.window.bytes(offset, G::HEAD_BYTES as u64)?;
        let Some(chunk) = G::chunk(head) else {
            return Ok(None);
        };
        if !chunk.has_checksum() {
            let is_plain = chunk.compression == Compression::None;
            let is_chunk = G::frame(head).is_some_and(|frame| frame.kind == Kind::Chunk);
            return match is_plain && is_chunk {
                true => self.plain_chunk(offset, reason).map(Some),
                false => Ok(None),
            };
        }
        let header_bytes = head.len() as u64 - chunk.data.len() as u64;
        let declared_end = offset
            .saturating_add(header_bytes)
            .saturating_add(chunk.declared_bytes);
        let candidates = [(declared_end, How::Whole), (until, How::AnyLength)];
        for (end, how) in candidates {
            if end > self.file.len() || end - offset > RECORD_LIMIT_BYTES {
                continue;
            }
            let bytes = offset..end;
            let unpacked = self.unpacking.load(&bytes, how)?;
            if unpacked.failure.is_none() {
                self.visitor.begin_chunk(offset, end);
                let flow = self.content(&unpacked, &bytes, LostPart::Chunk, None);
                let header = offset..offset + header_bytes;
                let reason = format!("{reason}: the header of a chunk whose content is intact");
                self.lose(LostPart::Records, header, reason);
                // The indexes that follow tell of messages that are not lost.
                self.log.end_of_indexes();
                self.unpacking.give_back(unpacked);
                return Ok(Some(match flow {
                    ControlFlow::Break(()) => After::Stop(ControlFlow::Break(())),
                    ControlFlow::Continue(()) => After::Resume(end),
                }));
            }
            self.unpacking.give_back(unpacked);
        }
        Ok(None)
    }

    /// A chunk that is not compressed and has no checksum: its records are found one by one.
    fn plain_chunk(&mut self, offset: u64, reason: &str) -> Result<After, Error> {
        let limit = offset
            .saturating_add(RECORD_LIMIT_BYTES)
            .min(self.file.len());
        let next = self.search(offset + 1, limit, Within::CheckedChunk)?;
        let bytes = offset..next.unwrap_or(limit);
        if !self.visitor.wants_chunk(offset) {
            self.lose(LostPart::Records, bytes.clone(), reason.to_owned());
            return Ok(After::Resume(bytes.end));
        }
        self.visitor.begin_chunk(offset, bytes.end);
        let unpacked = self.unpacking.load(&bytes, How::Partial)?;
        let flow = self.content(&unpacked, &bytes, LostPart::Chunk, Some(reason.to_owned()));
        self.unpacking.give_back(unpacked);
        Ok(match flow {
            ControlFlow::Break(()) => After::Stop(ControlFlow::Break(())),
            ControlFlow::Continue(()) => After::Resume(bytes.end),
        })
    }

    /// The rest of the file, which no record spans. A chunk that the end of the file cuts still
    /// yields its first messages.
    fn tail(&mut self, offset: u64, reason: String) -> Result<ControlFlow<()>, Error> {
        let bytes = offset..self.file.len();
        let head = self.window.bytes(offset, G::HEAD_BYTES as u64)?;
        let is_chunk = G::frame(head).is_some_and(|frame| frame.kind == Kind::Chunk);
        if !is_chunk || bytes.end - offset > RECORD_LIMIT_BYTES {
            self.lose(LostPart::Tail, bytes, reason);
            return Ok(ControlFlow::Continue(()));
        }
        if !self.visitor.wants_chunk(offset) {
            self.lose(LostPart::Tail, bytes, reason);
            return Ok(ControlFlow::Continue(()));
        }
        let unpacked = self.unpacking.load(&bytes, How::Partial)?;
        let flow = self.content(&unpacked, &bytes, LostPart::Tail, Some(reason));
        self.unpacking.give_back(unpacked);
        Ok(flow)
    }

    /// The first place from `from` on, before `until`, where a record certainly begins.
    fn search(&mut self, from: u64, until: u64, within: Within) -> Result<Option<u64>, Error> {
        let mut block = Vec::new();
        let mut start = from;
        while start < until {
            let count = SEARCH_BYTES.min(until - start);
            let available = self.file.len().saturating_sub(start);
            let seen = (count + G::HEAD_BYTES as u64).min(available);
            self.file.read_into(&mut block, start, seen)?;
            for at in 0..count as usize {
                let head = block.get(at..).unwrap_or_default();
                let head = head.get(..G::HEAD_BYTES).unwrap_or(head);
                let Some(frame) = G::frame(head) else {
                    continue;
                };
                let offset = start + at as u64;
                if within.may_hold(frame.kind) && self.is_beginning(offset, &frame)? {
                    return Ok(Some(offset));
                }
            }
            start += count;
        }
        Ok(None)
    }

    /// Whether this is the beginning of a record and not a chance likeness.
    fn is_beginning(&mut self, offset: u64, frame: &Frame) -> Result<bool, Error> {
        let remaining = self.file.len().saturating_sub(offset);
        if matches!(frame.kind, Kind::Unknown | Kind::Other) && !frame.is_certain {
            return Ok(false);
        }
        if frame.length_bytes > remaining {
            // A chunk that is cut may be the last thing in a file.
            return Ok(frame.kind == Kind::Chunk && frame.is_unmistakable);
        }
        // Compressed data may begin with what were whole messages or definitions.
        let may_be_packed = matches!(frame.kind, Kind::Message | Kind::Definition);
        if frame.is_unmistakable && !may_be_packed || self.is_place(offset + frame.length_bytes)? {
            return Ok(true);
        }
        let has_loose_messages = self.loose.messages > 0;
        if frame.kind != Kind::Message || !has_loose_messages || frame.length_bytes > SEARCH_BYTES {
            return Ok(false);
        }
        let record = self.window.bytes(offset, frame.length_bytes)?;
        let near_ns = self.log.last_time_ns();
        let message = G::message(record);
        Ok(message.is_some_and(|message| self.visitor.is_likely(&message, near_ns)))
    }

    fn lose(&mut self, part: LostPart, bytes: Range<u64>, reason: String) {
        if self.is_past_messages {
            return;
        }
        let nothing = BTreeMap::new();
        self.log.lose(part, bytes, reason, nothing, self.visitor);
    }
}

/// Where in the file the damage lies: exactly, if the content was not compressed.
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

/// The messages of a content by channel.
fn count<G: Grammar>(content: &[u8]) -> BTreeMap<u32, u64> {
    let mut counter = Counter::default();
    // A counter never stops by itself.
    let _ = Tally::default().walk_unverified::<G, _>(content, &mut counter);
    counter.0
}

#[derive(Default)]
struct Counter(BTreeMap<u32, u64>);

impl Visitor for Counter {
    fn definition(&mut self, _definition: &Definition<'_>) -> bool {
        true
    }

    fn message(&mut self, record: &MessageRecord<'_>) -> Next {
        *self.0.entry(record.channel_id).or_default() += 1;
        Next::Continue
    }

    fn topic_name(&self, _channel_id: u32) -> Option<&str> {
        None
    }
}
