//! Bags of ROS 1, version 2.0: how their records are written, and what their index tells.

mod header;
mod index;

use self::header::op;
use crate::{
    error::Error,
    file_bytes::FileBytes,
    records::{
        ChannelRecord, Compression, Contents, Definition, Frame, Grammar, Kind, MessageRecord,
        PackedChunk, SchemaRecord,
    },
};

/// The line that every bag begins with.
pub(crate) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// The records of a bag.
pub(crate) struct Bag;

impl Grammar for Bag {
    const FIRST_RECORD: u64 = MAGIC.len() as u64;
    const HEAD_BYTES: usize = 2048;

    #[inline]
    fn frame(head: &[u8]) -> Option<Frame> {
        let (header, data_bytes, header_bytes) = header::frame(head)?;
        let kind = kind_of(header.op)?;
        Some(Frame {
            kind,
            length_bytes: header_bytes + u64::from(data_bytes),
            // Nothing confirms the length of the data.
            is_certain: false,
            is_unmistakable: true,
        })
    }

    fn complaint(head: &[u8]) -> String {
        let shown = head.get(..16).unwrap_or(head).escape_ascii();
        format!("expected a record, found the bytes \"{shown}\"")
    }

    fn is_closing(_rest: &[u8]) -> bool {
        false
    }

    #[inline]
    fn split(bytes: &[u8]) -> Option<(Kind, &[u8], &[u8])> {
        let (header, data_bytes, header_bytes) = header::frame(bytes)?;
        let length = usize::try_from(header_bytes + u64::from(data_bytes)).ok()?;
        let (record, rest) = bytes.split_at_checked(length)?;
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

    fn definition(record: &[u8], take: &mut dyn FnMut(Definition<'_>)) -> bool {
        connection(record, take).is_some()
    }

    fn chunk(record: &[u8]) -> Option<PackedChunk<'_>> {
        let (header, declared_bytes, header_bytes) = header::frame(record)?;
        let compression = match header.compression? {
            b"none" => Compression::None,
            b"lz4" => Compression::Lz4,
            b"bz2" => Compression::Bz2,
            other => Compression::Other(std::str::from_utf8(other).unwrap_or("no text")),
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
        // The chunk infos are the last part of a bag.
        op::CHUNK_INFO => Kind::End,
        op::CONNECTION => Kind::Definition,
        _ => return None,
    })
}

/// A connection: a topic and its type at once, under one number.
fn connection(record: &[u8], take: &mut dyn FnMut(Definition<'_>)) -> Option<()> {
    let (header, data) = header::split(record)?;
    let id = header.connection?;
    let topic = std::str::from_utf8(header.topic?).ok()?;
    let mut type_name = None;
    let mut definition = &b""[..];
    header::fields(data, |name, value| match name {
        b"type" => type_name = std::str::from_utf8(value).ok(),
        b"message_definition" => definition = value,
        _ => {}
    })?;
    let schema = SchemaRecord {
        name: type_name?,
        encoding: "ros1msg",
        data: definition,
    };
    take(Definition::Schema { id, schema });
    let channel = ChannelRecord {
        schema_id: Some(id),
        topic,
        encoding: "ros1",
    };
    take(Definition::Channel { id, channel });
    Some(())
}
