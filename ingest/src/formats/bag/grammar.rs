//! The record syntax of bags.

use tipwatch_language::say;

use super::{
    connection::connection,
    header::{self, op},
    index,
};
use crate::{
    file::FileBytes,
    formats::records::{
        Compression, Contents, DefinitionRecord, Frame, Grammar, Kind, MessageRecord, PackedChunk,
    },
    message::Error,
};

/// The records of a bag.
pub(crate) struct Bag;

impl Grammar for Bag {
    const FIRST_RECORD: u64 = header::FIRST_RECORD;
    const HEAD_BYTES: usize = header::HEAD_BYTES;

    #[inline]
    fn frame(head: &[u8]) -> Option<Frame> {
        let (header, data_bytes, header_bytes) = header::frame(head)?;
        let kind = kind_of(header.op)?;
        Some(Frame {
            kind,
            length_bytes: header_bytes + u64::from(data_bytes),
            // No second field confirms the length of the data.
            is_certain: false,
            is_unmistakable: true,
        })
    }

    fn complaint(head: &[u8]) -> String {
        let shown = head.get(..16).unwrap_or(head).escape_ascii();
        say!("expected a record, found the bytes \"{shown}\"")
    }

    fn is_closing(_rest: &[u8]) -> bool {
        false
    }

    #[inline]
    fn split(bytes: &[u8]) -> Option<(Kind, &[u8], &[u8])> {
        let (header, record, rest) = header::split_first(bytes)?;
        Some((kind_of(header.op).unwrap_or(Kind::Unknown), record, rest))
    }

    #[inline]
    fn message(record: &[u8]) -> Option<MessageRecord<'_>> {
        let (header, data) = header::split(record)?;
        let time_ns = header.time_ns?;
        Some(MessageRecord {
            channel_id: header.connection?,
            sequence: 0,
            log_time_ns: time_ns,
            publish_time_ns: time_ns,
            data,
        })
    }

    fn definition(record: &[u8], take: &mut dyn FnMut(DefinitionRecord<'_>)) -> bool {
        connection(record, take).is_some()
    }

    fn chunk(record: &[u8]) -> Option<PackedChunk<'_>> {
        let (header, declared_bytes, header_bytes) = header::frame(record)?;
        let compression = match header.compression? {
            b"none" => Compression::None,
            b"lz4" => Compression::Lz4,
            b"bz2" => Compression::Bz2,
            other => Compression::Other(std::str::from_utf8(other).unwrap_or("not text")),
        };
        let data = record.get(usize::try_from(header_bytes).ok()?..)?;
        let taken = data.len().min(declared_bytes as usize);
        Some(PackedChunk {
            compression,
            uncompressed_bytes: u64::from(header.size?),
            crc: None,
            declared_bytes: u64::from(declared_bytes),
            data: data.get(..taken)?,
        })
    }

    fn index(record: &[u8]) -> Option<(u32, u64)> {
        let (header, ..) = header::frame(record)?;
        Some((header.connection?, u64::from(header.count?)))
    }

    fn contents(file: &FileBytes) -> Result<Option<Contents>, Error> {
        index::read(file)
    }
}

fn kind_of(op: u8) -> Option<Kind> {
    Some(match op {
        op::MESSAGE => Kind::Message,
        op::BAG_HEADER => Kind::Other,
        op::INDEX => Kind::Index,
        op::CHUNK => Kind::Chunk,
        // Chunk info records are the last part of a bag.
        op::CHUNK_INFO => Kind::End,
        op::CONNECTION => Kind::Definition,
        _ => return None,
    })
}
