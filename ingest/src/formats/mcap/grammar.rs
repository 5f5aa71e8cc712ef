//! The record syntax of MCAP.

use mcap::records::op;
use tipwatch_language::{say, word};

use super::{
    extra::of_mcap_record,
    record::{self, ChunkRecord, RECORD_HEADER_BYTES},
    shape, summary,
};
use crate::{
    file::FileBytes,
    formats::records::{
        Contents, DefinitionRecord, Frame, Grammar, Kind, MessageRecord, PackedChunk,
    },
    message::{Error, Extra},
};

/// The records of an MCAP file.
pub(crate) struct Mcap;

impl Grammar for Mcap {
    const FIRST_RECORD: u64 = mcap::MAGIC.len() as u64;
    const HEAD_BYTES: usize = 512;

    #[inline]
    fn frame(head: &[u8]) -> Option<Frame> {
        let (opcode, body_bytes) = record::record_header(head)?;
        let kind = kind_of(opcode)?;
        let body = head.get(RECORD_HEADER_BYTES..).unwrap_or_default();
        let is_certain = shape::fits(opcode, body, body_bytes)?;
        // zeros in the place of lengths would make an empty chunk with its content behind it
        let is_chunk = kind == Kind::Chunk && !is_certain;
        if is_chunk && ChunkRecord::parse(body).is_some_and(|chunk| !chunk.is_coherent()) {
            return None;
        }
        Some(Frame {
            kind,
            length_bytes: body_bytes.saturating_add(RECORD_HEADER_BYTES as u64),
            is_certain,
            is_unmistakable: is_certain,
        })
    }

    fn complaint(head: &[u8]) -> String {
        match record::record_header(head) {
            None => say!("expected a record, found only {} more bytes", head.len()),
            Some((0, _)) => word!("expected a record, found opcode 0").to_owned(),
            Some((opcode, bytes)) => say!(
                "expected a record, found opcode {opcode} with {bytes} bytes, a length that does \
                 not fit its fields"
            ),
        }
    }

    fn is_closing(rest: &[u8]) -> bool {
        rest == mcap::MAGIC
    }

    #[inline]
    fn split(bytes: &[u8]) -> Option<(Kind, &[u8], &[u8])> {
        let (opcode, body_bytes) = record::record_header(bytes)?;
        let length = usize::try_from(body_bytes)
            .ok()?
            .checked_add(RECORD_HEADER_BYTES)?;
        let (record, rest) = bytes.split_at_checked(length)?;
        Some((kind_of(opcode).unwrap_or(Kind::Unknown), record, rest))
    }

    #[inline]
    fn message(record: &[u8]) -> Option<MessageRecord<'_>> {
        record::message(record.get(RECORD_HEADER_BYTES..)?)
    }

    fn definition(record: &[u8], take: &mut dyn FnMut(DefinitionRecord<'_>)) -> bool {
        let Some((opcode, body, _)) = record::split_record(record) else {
            return false;
        };
        let definition = match opcode {
            op::SCHEMA => record::schema(body),
            _ => record::channel(body),
        };
        definition.map(take).is_some()
    }

    fn chunk(record: &[u8]) -> Option<PackedChunk<'_>> {
        ChunkRecord::parse(record.get(RECORD_HEADER_BYTES..)?).map(ChunkRecord::packed)
    }

    fn index(record: &[u8]) -> Option<(u32, u64)> {
        record::index(record.get(RECORD_HEADER_BYTES..)?)
    }

    fn extra(record: &[u8]) -> Option<Extra<'_>> {
        of_mcap_record(record)
    }

    fn contents(file: &FileBytes) -> Result<Option<Contents>, Error> {
        summary::read(file)
    }
}

/// `None` for zero, the only invalid opcode.
fn kind_of(opcode: u8) -> Option<Kind> {
    Some(match opcode {
        0 => return None,
        op::MESSAGE => Kind::Message,
        op::CHUNK => Kind::Chunk,
        op::SCHEMA | op::CHANNEL => Kind::Definition,
        op::MESSAGE_INDEX => Kind::Index,
        op::DATA_END | op::FOOTER => Kind::End,
        op::HEADER..=op::METADATA_INDEX | op::SUMMARY_OFFSET => Kind::Other,
        _ => Kind::Unknown,
    })
}
