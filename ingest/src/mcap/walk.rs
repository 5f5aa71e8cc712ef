//! One pass over the records of a file. Every length is checked before it is followed.
//!
//! Where a record cannot be followed, the walk goes on at the next chunk that the index knows;
//! without an index the rest of the file is lost.

use std::ops::{Bound, ControlFlow, Range};

use mcap::records::op;

use super::{
    ChunkDirectory,
    chunk::Decompressor,
    record::{self, ChannelRecord, ChunkRecord, MessageRecord, RECORD_HEADER_BYTES, SchemaRecord},
};
use crate::{
    error::Error,
    file_bytes::{FileBytes, Window},
    losses::{Losses, LostPart},
};

const HEADER_BYTES: u64 = RECORD_HEADER_BYTES as u64;
const MAGIC_BYTES: u64 = mcap::MAGIC.len() as u64;
/// What is read at once; attachments may be larger, they are passed over.
const RECORD_LIMIT_BYTES: u64 = 1 << 30;
/// Start, end, size and CRC come before the name of the compression in a chunk.
const CHUNK_CRC_OFFSET: u64 = HEADER_BYTES + 24;

/// What to do after a message.
#[derive(PartialEq, Eq)]
pub(super) enum Next {
    Continue,
    /// Go on, but the message belongs to no channel that was defined.
    UndefinedChannel,
    Stop,
}

/// Sees what the walk meets.
pub(super) trait Visitor {
    /// Whether the chunk at this offset is worth decompressing.
    fn wants_chunk(&mut self, _offset: u64) -> bool {
        true
    }
    fn schema(&mut self, _record: &SchemaRecord<'_>) {}
    /// `false` when it contradicts what was defined before.
    fn channel(&mut self, _record: &ChannelRecord<'_>) -> bool {
        true
    }
    fn message(&mut self, record: &MessageRecord<'_>) -> Next;
    fn progress(&mut self, _offset: u64) {}
}

/// Walks the data section of a file from its beginning.
pub(super) fn walk<V: Visitor>(
    file: &FileBytes,
    chunks: &ChunkDirectory,
    visitor: &mut V,
    losses: &mut Losses,
) -> Result<ControlFlow<()>, Error> {
    Walk {
        file,
        chunks,
        visitor,
        losses,
        window: Window::new(file),
        decompressor: Decompressor::default(),
        loose: Tally::default(),
        loose_range: 0..0,
    }
    .run()
}

/// The checksum in the header of the chunk at `offset`, if there is a chunk.
pub(super) fn chunk_crc_at(window: &mut Window<'_>, offset: u64) -> Result<Option<u32>, Error> {
    let head = window.bytes(offset, CHUNK_CRC_OFFSET + 4)?;
    let is_chunk = head.first() == Some(&op::CHUNK);
    let crc = head
        .last_chunk::<4>()
        .filter(|_| is_chunk && head.len() as u64 > CHUNK_CRC_OFFSET);
    Ok(crc.map(|bytes| u32::from_le_bytes(*bytes)))
}

struct Walk<'w, V> {
    file: &'w FileBytes,
    chunks: &'w ChunkDirectory,
    visitor: &'w mut V,
    losses: &'w mut Losses,
    window: Window<'w>,
    decompressor: Decompressor,
    /// What went wrong with single records outside chunks.
    loose: Tally,
    loose_range: Range<u64>,
}

/// What stands at an offset.
enum Place {
    Record {
        opcode: u8,
        end: u64,
    },
    End,
    /// Nothing follows, not even an end mark.
    Unclosed,
    Damaged {
        reason: String,
    },
}

impl<V: Visitor> Walk<'_, V> {
    fn run(mut self) -> Result<ControlFlow<()>, Error> {
        let mut offset = MAGIC_BYTES;
        let flow = loop {
            match self.place_at(offset)? {
                Place::Record { opcode, end } => {
                    if opcode == op::DATA_END || opcode == op::FOOTER {
                        break ControlFlow::Continue(());
                    }
                    if self.record(opcode, offset..end)?.is_break() {
                        break ControlFlow::Break(());
                    }
                    offset = end;
                }
                Place::End => break ControlFlow::Continue(()),
                Place::Unclosed => {
                    let reason = "the recording was not closed: what would follow is unknown";
                    self.lose(LostPart::Tail, offset..offset, reason.to_owned());
                    break ControlFlow::Continue(());
                }
                Place::Damaged { reason } => match self.next_known_chunk(offset) {
                    Some(next) => {
                        self.lose(LostPart::Records, offset..next, reason);
                        offset = next;
                    }
                    None => break self.tail(offset, reason)?,
                },
            }
        };
        self.report_loose_records();
        Ok(flow)
    }

    fn place_at(&mut self, offset: u64) -> Result<Place, Error> {
        let remaining = self.file.len().saturating_sub(offset);
        let head = self.window.bytes(offset, HEADER_BYTES)?;
        let Some((opcode, body_bytes)) = record::record_header(head) else {
            return Ok(end_of_file(head));
        };
        let length_bytes = body_bytes.saturating_add(HEADER_BYTES);
        let end = offset.saturating_add(length_bytes);
        let is_read = matches!(opcode, op::CHUNK | op::SCHEMA | op::CHANNEL | op::MESSAGE);
        Ok(if opcode == 0 {
            Place::Damaged {
                reason: "expected a record, found opcode 0".to_owned(),
            }
        } else if is_read && length_bytes > RECORD_LIMIT_BYTES {
            let reason = format!("a record (opcode {opcode}) of implausible {length_bytes} bytes");
            Place::Damaged { reason }
        } else if length_bytes > remaining {
            let reason = format!(
                "a record (opcode {opcode}) of {length_bytes} bytes, but the file ends after \
                 {remaining} bytes"
            );
            Place::Damaged { reason }
        } else if self.next_known_chunk(offset).is_some_and(|next| next < end) {
            let reason =
                format!("a record (opcode {opcode}) of {length_bytes} bytes runs into a chunk");
            Place::Damaged { reason }
        } else {
            Place::Record { opcode, end }
        })
    }

    fn next_known_chunk(&self, offset: u64) -> Option<u64> {
        let after = (Bound::Excluded(offset), Bound::Unbounded);
        self.chunks.range(after).next().map(|(&next, _)| next)
    }

    fn record(&mut self, opcode: u8, bytes: Range<u64>) -> Result<ControlFlow<()>, Error> {
        match opcode {
            op::CHUNK => {
                let flow = self.chunk(bytes.clone())?;
                self.visitor.progress(bytes.end);
                Ok(flow)
            }
            op::SCHEMA | op::CHANNEL | op::MESSAGE => self.loose_record(bytes),
            _ => Ok(ControlFlow::Continue(())),
        }
    }

    fn chunk(&mut self, bytes: Range<u64>) -> Result<ControlFlow<()>, Error> {
        if !self.visitor.wants_chunk(bytes.start) {
            return Ok(ControlFlow::Continue(()));
        }
        let whole = self.window.bytes(bytes.start, bytes.end - bytes.start)?;
        let body = whole.get(RECORD_HEADER_BYTES..).unwrap_or_default();
        let Some(chunk) = ChunkRecord::parse(body) else {
            self.lose(LostPart::Chunk, bytes, "unreadable chunk header".to_owned());
            return Ok(ControlFlow::Continue(()));
        };
        self.losses.saw_checksum(chunk.crc != 0);
        match self.decompressor.content(&chunk) {
            Ok(content) => {
                let mut tally = Tally::default();
                let flow = tally.walk(content, self.visitor);
                self.report_chunk(&tally, bytes);
                Ok(flow)
            }
            Err(reason) => {
                self.lose(LostPart::Chunk, bytes, reason);
                Ok(ControlFlow::Continue(()))
            }
        }
    }

    fn report_chunk(&mut self, tally: &Tally, bytes: Range<u64>) {
        if let Some(reason) = tally.reason() {
            self.lose(LostPart::Chunk, bytes, reason);
        }
    }

    /// A record outside chunks. Every kind goes through the same code as within.
    fn loose_record(&mut self, bytes: Range<u64>) -> Result<ControlFlow<()>, Error> {
        let whole = self.window.bytes(bytes.start, bytes.end - bytes.start)?;
        let before = self.loose.sum();
        let flow = self.loose.walk(whole, self.visitor);
        if whole.first() == Some(&op::MESSAGE) {
            self.losses.integrity.checksums_absent = true;
        }
        if self.loose.sum() != before {
            let start = if before == 0 {
                bytes.start
            } else {
                self.loose_range.start
            };
            self.loose_range = start..bytes.end;
        }
        Ok(flow)
    }

    fn report_loose_records(&mut self) {
        if let Some(reason) = self.loose.reason() {
            let range = self.loose_range.clone();
            self.lose(LostPart::Records, range, reason);
        }
    }

    /// The rest of the file, which no record spans. A chunk that the end of the file cuts still
    /// yields its first messages.
    fn tail(&mut self, offset: u64, reason: String) -> Result<ControlFlow<()>, Error> {
        let file_bytes = self.file.len();
        let head = self.window.bytes(offset, HEADER_BYTES)?;
        // A longer one is no cut chunk but a damaged length.
        let is_cut_chunk = record::record_header(head)
            .is_some_and(|(opcode, bytes)| opcode == op::CHUNK && bytes < RECORD_LIMIT_BYTES);
        let mut tally = Tally::default();
        let mut flow = ControlFlow::Continue(());
        if is_cut_chunk && self.visitor.wants_chunk(offset) {
            let whole = self.window.bytes(offset, file_bytes - offset)?;
            let body = whole.get(RECORD_HEADER_BYTES..).unwrap_or_default();
            if let Some(chunk) = ChunkRecord::parse(body) {
                flow = tally.walk(self.decompressor.partial_content(&chunk), self.visitor);
            }
        }
        let recovered = match tally.messages {
            0 => String::new(),
            count => {
                self.losses.integrity.checksums_absent = true;
                format!("; the first {count} messages of this chunk were read, unverified")
            }
        };
        self.lose(
            LostPart::Tail,
            offset..file_bytes,
            format!("{reason}{recovered}"),
        );
        Ok(flow)
    }

    fn lose(&mut self, part: LostPart, bytes: Range<u64>, reason: String) {
        self.losses.lose(part, self.file.path(), bytes, reason);
    }
}

fn end_of_file(head: &[u8]) -> Place {
    if head == mcap::MAGIC {
        Place::End
    } else if head.is_empty() {
        Place::Unclosed
    } else {
        let reason = format!("expected a record, found only {} more bytes", head.len());
        Place::Damaged { reason }
    }
}

/// Walks the records of a chunk and counts what is wrong with them.
#[derive(Default)]
struct Tally {
    messages: u64,
    undefined_channel: u64,
    unreadable: u64,
    contradictory: u64,
    /// Bytes at the end that form no record.
    rest_bytes: usize,
}

impl Tally {
    fn walk<V: Visitor>(&mut self, content: &[u8], visitor: &mut V) -> ControlFlow<()> {
        let mut rest = content;
        while !rest.is_empty() {
            let Some((opcode, body, next)) = record::split_record(rest) else {
                self.rest_bytes = rest.len();
                break;
            };
            rest = next;
            if opcode == op::MESSAGE {
                self.message(body, visitor)?;
            } else {
                self.definition(opcode, body, visitor);
            }
        }
        ControlFlow::Continue(())
    }

    #[inline]
    fn message<V: Visitor>(&mut self, body: &[u8], visitor: &mut V) -> ControlFlow<()> {
        let Some(message) = MessageRecord::parse(body) else {
            self.unreadable += 1;
            return ControlFlow::Continue(());
        };
        self.messages += 1;
        match visitor.message(&message) {
            Next::Continue => ControlFlow::Continue(()),
            Next::Stop => ControlFlow::Break(()),
            Next::UndefinedChannel => {
                self.undefined_channel += 1;
                ControlFlow::Continue(())
            }
        }
    }

    fn definition<V: Visitor>(&mut self, opcode: u8, body: &[u8], visitor: &mut V) {
        match opcode {
            op::SCHEMA => match SchemaRecord::parse(body) {
                Some(schema) => visitor.schema(&schema),
                None => self.unreadable += 1,
            },
            op::CHANNEL => match ChannelRecord::parse(body) {
                Some(channel) => self.contradictory += u64::from(!visitor.channel(&channel)),
                None => self.unreadable += 1,
            },
            0 => self.unreadable += 1,
            _ => {}
        }
    }

    fn sum(&self) -> u64 {
        self.undefined_channel + self.unreadable + self.contradictory
    }

    fn reason(&self) -> Option<String> {
        let mut parts = Vec::new();
        let counted = [
            (
                self.undefined_channel,
                "messages of channels that are not defined",
            ),
            (self.unreadable, "unreadable records"),
            (
                self.contradictory,
                "channels defined again otherwise (the first definition is kept)",
            ),
            (
                self.rest_bytes as u64,
                "bytes at the end that form no record",
            ),
        ];
        for (count, what) in counted {
            if count > 0 {
                parts.push(format!("{count} {what}"));
            }
        }
        (!parts.is_empty()).then(|| parts.join(", "))
    }
}
