//! Resynchronisation of the walk after damage.

use std::ops::ControlFlow;

use tipwatch_language::say;

use super::{
    grammar::{Frame, Grammar, Kind},
    packed_chunk::Compression,
    unpacked::LoadMode,
    visitor::Visitor,
    walk::{RECORD_LIMIT_BYTES, Resumption, SearchScope, Walk},
};
use crate::message::{Error, LostPart};

/// Block size of the search for the next record.
const SEARCH_BYTES: u64 = 256 << 10;

impl SearchScope {
    fn may_hold(self, kind: Kind) -> bool {
        self == Self::Anything || !matches!(kind, Kind::Message | Kind::Definition)
    }
}

impl<G: Grammar, V: Visitor> Walk<'_, G, V> {
    /// Returns the scope of the search for intact data behind the first byte of the record at `offset`.
    pub(super) fn within(&mut self, offset: u64) -> Result<SearchScope, Error> {
        let head = self.window.bytes(offset, G::HEAD_BYTES as u64)?;
        let is_chunk = G::frame(head).is_some_and(|frame| frame.kind == Kind::Chunk);
        let is_checked = is_chunk && G::chunk(head).is_some_and(|chunk| chunk.has_checksum());
        Ok(match is_checked {
            true => SearchScope::CheckedChunk,
            false => SearchScope::Anything,
        })
    }

    /// Handles an invalid record at `offset`: a chunk with a damaged header, a chunk cut off by the
    /// end of the file, or anything else, after which the next record must be searched.
    pub(super) fn damaged(&mut self, offset: u64, reason: String) -> Result<Resumption, Error> {
        let file_bytes = self.file.len();
        let head = self.window.bytes(offset, G::HEAD_BYTES as u64)?;
        let is_cut = G::frame(head).is_some_and(|frame| {
            let end = offset.saturating_add(frame.length_bytes);
            frame.kind == Kind::Chunk && frame.is_certain && end > file_bytes
        });
        if is_cut {
            return self.tail(offset, reason).map(Resumption::Stop);
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
            return Ok(Resumption::Resume(next));
        }
        self.tail(offset, reason).map(Resumption::Stop)
    }

    /// Reads a chunk whose kind or length is damaged, if its checksum confirms the content.
    pub(super) fn mended_chunk(
        &mut self,
        offset: u64,
        next: Option<u64>,
        reason: &str,
    ) -> Result<Option<Resumption>, Error> {
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
        let candidates = [
            (declared_end, LoadMode::Whole),
            (until, LoadMode::AnyLength),
        ];
        for (end, how) in candidates {
            if end > self.file.len() || end - offset > RECORD_LIMIT_BYTES {
                continue;
            }
            let bytes = offset..end;
            let mut unpacked = self.unpacking.load(&bytes, how)?;
            if unpacked.failure.is_none() {
                self.visitor.begin_chunk(offset, end);
                let flow = self.content(&mut unpacked, &bytes, LostPart::Chunk, None);
                let header = offset..offset + header_bytes;
                let reason = say!("{reason}: the header of a chunk whose content is intact");
                self.lose(LostPart::Records, header, reason);
                // The index records that follow count messages that are not lost.
                self.log.expect_no_indexes();
                self.unpacking.give_back(unpacked);
                return Ok(Some(match flow {
                    ControlFlow::Break(()) => Resumption::Stop(ControlFlow::Break(())),
                    ControlFlow::Continue(()) => Resumption::Resume(end),
                }));
            }
            self.unpacking.give_back(unpacked);
        }
        Ok(None)
    }

    /// Reads an uncompressed chunk without a checksum record by record, up to the next record
    /// outside chunks. If bytes are missing, that may be the index of a later chunk, whose messages
    /// are then included.
    fn plain_chunk(&mut self, offset: u64, reason: &str) -> Result<Resumption, Error> {
        let limit = offset
            .saturating_add(RECORD_LIMIT_BYTES)
            .min(self.file.len());
        let next = self.search(offset + 1, limit, SearchScope::CheckedChunk)?;
        let bytes = offset..next.unwrap_or(limit);
        if !self.visitor.wants_chunk(offset) {
            self.lose(LostPart::Records, bytes.clone(), reason.to_owned());
            return Ok(Resumption::Resume(bytes.end));
        }
        self.visitor.begin_chunk(offset, bytes.end);
        let mut unpacked = self.unpacking.load(&bytes, LoadMode::PlainToEnd)?;
        let flow = self.content(
            &mut unpacked,
            &bytes,
            LostPart::Chunk,
            Some(reason.to_owned()),
        );
        self.unpacking.give_back(unpacked);
        // the index records that follow may belong to another chunk
        self.log.expect_no_indexes();
        Ok(match flow {
            ControlFlow::Break(()) => Resumption::Stop(ControlFlow::Break(())),
            ControlFlow::Continue(()) => Resumption::Resume(bytes.end),
        })
    }

    /// Handles the rest of the file. A chunk cut off by the end of the file still yields its first
    /// messages.
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
        let mut unpacked = self.unpacking.load(&bytes, LoadMode::Partial)?;
        let flow = self.content(&mut unpacked, &bytes, LostPart::Tail, Some(reason));
        self.unpacking.give_back(unpacked);
        Ok(flow)
    }

    /// The first offset in `from..until` at which a record certainly begins.
    pub(super) fn search(
        &mut self,
        from: u64,
        until: u64,
        within: SearchScope,
    ) -> Result<Option<u64>, Error> {
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

    /// Whether a record really begins here, rather than bytes that resemble one by chance.
    fn is_beginning(&mut self, offset: u64, frame: &Frame) -> Result<bool, Error> {
        let remaining = self.file.len().saturating_sub(offset);
        if matches!(frame.kind, Kind::Unknown | Kind::Other) && !frame.is_certain {
            return Ok(false);
        }
        if frame.length_bytes > remaining {
            // A truncated chunk may be the last record of a file.
            return Ok(frame.kind == Kind::Chunk && frame.is_unmistakable);
        }
        // Compressed data may contain literal copies of messages or definitions.
        let may_be_packed = matches!(frame.kind, Kind::Message | Kind::Definition);
        if frame.is_unmistakable && !may_be_packed
            || self.is_boundary(offset + frame.length_bytes)?
        {
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
}
