//! Parses the MCAP records that are needed, checking every length.
//!
//! Records borrow from the bytes they are parsed from. A length beyond them makes the record
//! unreadable; it never causes an allocation.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::formats::records::{
    Channel, Compression, DefinitionRecord, MessageRecord, PackedChunk, SchemaRecord,
};

/// Size of the opcode and length before every record.
pub(super) const RECORD_HEADER_BYTES: usize = 9;

/// Time and offset of a message in an index.
pub(super) const INDEX_ENTRY_BYTES: u64 = 16;

/// Splits off one record: opcode, body and the rest. `None` if it does not fit.
#[inline]
pub(super) fn split_record(bytes: &[u8]) -> Option<(u8, &[u8], &[u8])> {
    let (opcode, body_bytes) = record_header(bytes)?;
    let body_bytes = usize::try_from(body_bytes).ok()?;
    let (body, rest) = bytes
        .get(RECORD_HEADER_BYTES..)?
        .split_at_checked(body_bytes)?;
    Some((opcode, body, rest))
}

/// The opcode and the length of the body that follows.
#[inline]
pub(super) fn record_header(bytes: &[u8]) -> Option<(u8, u64)> {
    let (&opcode, rest) = bytes.split_first()?;
    let body_bytes = rest.first_chunk::<8>()?;
    Some((opcode, u64::from_le_bytes(*body_bytes)))
}

/// Reads little-endian values from the front of a record's body.
pub(super) struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    pub(super) fn new(body: &'a [u8]) -> Self {
        Self { rest: body }
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.rest.split_first_chunk::<N>()?;
        self.rest = rest;
        Some(*head)
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    fn bytes(&mut self, count: u64) -> Option<&'a [u8]> {
        let (head, rest) = self.rest.split_at_checked(usize::try_from(count).ok()?)?;
        self.rest = rest;
        Some(head)
    }

    /// Bytes preceded by their length.
    fn sized_bytes(&mut self) -> Option<&'a [u8]> {
        let count = self.u32()?;
        self.bytes(u64::from(count))
    }

    fn text(&mut self) -> Option<&'a str> {
        std::str::from_utf8(self.sized_bytes()?).ok()
    }

    /// Keys and values.
    fn map(&mut self) -> Option<BTreeMap<String, String>> {
        let mut entries = Fields::new(self.sized_bytes()?);
        let mut map = BTreeMap::new();
        while !entries.rest.is_empty() {
            map.insert(entries.text()?.to_owned(), entries.text()?.to_owned());
        }
        Some(map)
    }

    fn time_ns(&mut self) -> Option<i64> {
        // A time beyond the year 2262 is damage; it is clamped to the end of the range.
        self.u64()
            .map(|time_ns| i64::try_from(time_ns).unwrap_or(i64::MAX))
    }
}

/// A message type.
pub(super) fn schema(body: &[u8]) -> Option<DefinitionRecord<'_>> {
    let mut fields = Fields::new(body);
    let id = u32::from(fields.u16()?);
    let schema = SchemaRecord {
        name: fields.text()?,
        encoding: fields.text()?,
        data: fields.sized_bytes()?,
    };
    Some(DefinitionRecord::Schema { id, schema })
}

/// A topic of one writer.
pub(super) fn channel(body: &[u8]) -> Option<DefinitionRecord<'_>> {
    let mut fields = Fields::new(body);
    let id = u32::from(fields.u16()?);
    let schema_id = u32::from(fields.u16()?);
    let channel = Channel {
        // Zero means no schema.
        schema_id: (schema_id != 0).then_some(schema_id),
        topic: fields.text()?.to_owned(),
        encoding: fields.text()?.to_owned(),
        says: fields.map().unwrap_or_default(),
    };
    Some(DefinitionRecord::Channel { id, channel })
}

/// A message.
#[inline]
pub(super) fn message(body: &[u8]) -> Option<MessageRecord<'_>> {
    let mut fields = Fields::new(body);
    Some(MessageRecord {
        channel_id: u32::from(fields.u16()?),
        sequence: fields.u32()?,
        log_time_ns: fields.time_ns()?,
        publish_time_ns: fields.time_ns()?,
        data: fields.rest,
    })
}

/// A channel and the number of its messages in the preceding chunk.
pub(super) fn index(body: &[u8]) -> Option<(u32, u64)> {
    let mut fields = Fields::new(body);
    let channel = u32::from(fields.u16()?);
    Some((channel, u64::from(fields.u32()?) / INDEX_ENTRY_BYTES))
}

/// A chunk before decompression.
pub(super) struct ChunkRecord<'a> {
    uncompressed_bytes: u64,
    crc: u32,
    compression: &'a str,
    compressed_bytes: u64,
    data: &'a [u8],
}

impl<'a> ChunkRecord<'a> {
    pub(super) fn parse(body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields::new(body);
        let (_first_time, _last_time) = (fields.u64()?, fields.u64()?);
        let uncompressed_bytes = fields.u64()?;
        let crc = fields.u32()?;
        let compression = fields.text()?;
        let compressed_bytes = fields.u64()?;
        let available = fields.rest.len();
        let taken = usize::try_from(compressed_bytes)
            .unwrap_or(available)
            .min(available);
        let data = fields.rest.get(..taken)?;
        Some(Self {
            uncompressed_bytes,
            crc,
            compression,
            compressed_bytes,
            data,
        })
    }

    /// Whether the fields agree with each other; asked where bytes follow that belong to no field.
    pub(super) fn is_coherent(&self) -> bool {
        let is_plain = self.compression.is_empty();
        self.compressed_bytes > 0
            && self.uncompressed_bytes > 0
            && (!is_plain || self.uncompressed_bytes == self.compressed_bytes)
    }

    pub(super) fn packed(self) -> PackedChunk<'a> {
        PackedChunk {
            compression: match self.compression {
                "" => Compression::None,
                "lz4" => Compression::Lz4,
                "zstd" => Compression::Zstd,
                other => Compression::Other(other),
            },
            uncompressed_bytes: self.uncompressed_bytes,
            // Zero if the writer computed none.
            crc: (self.crc != 0).then_some(self.crc),
            declared_bytes: self.compressed_bytes,
            data: self.data,
        }
    }
}

/// Position and channels of a chunk.
pub(super) struct ChunkIndexRecord {
    pub(super) offset: u64,
    pub(super) length_bytes: u64,
    pub(super) span_ns: (i64, i64),
    pub(super) channels: Vec<u32>,
    /// Length of the message indexes behind the chunk.
    pub(super) indexes_bytes: u64,
}

impl ChunkIndexRecord {
    pub(super) fn parse(body: &[u8]) -> Option<Self> {
        let mut fields = Fields::new(body);
        let span_ns = (fields.time_ns()?, fields.time_ns()?);
        let offset = fields.u64()?;
        let length_bytes = fields.u64()?;
        let mut entries = Fields::new(fields.sized_bytes()?);
        let mut channels = Vec::new();
        while !entries.rest.is_empty() {
            channels.push(u32::from(entries.u16()?));
            entries.u64()?;
        }
        Some(Self {
            offset,
            length_bytes,
            span_ns,
            channels,
            indexes_bytes: fields.u64()?,
        })
    }
}

/// The bytes of an attachment that its checksum, which follows them, covers.
pub(super) fn attachment_bytes(body: &[u8]) -> Option<&[u8]> {
    let mut fields = Fields::new(body);
    let (_log_time, _create_time) = (fields.u64()?, fields.u64()?);
    let (_name, _media_type) = (fields.sized_bytes()?, fields.sized_bytes()?);
    let data_bytes = fields.u64()?;
    fields.bytes(data_bytes)?;
    body.get(..body.len() - fields.rest.len())
}

/// Returns the range at which the index places an attachment or a metadata record.
pub(super) fn extra_place(index_body: &[u8]) -> Option<Range<u64>> {
    let mut fields = Fields::new(index_body);
    let (offset, length_bytes) = (fields.u64()?, fields.u64()?);
    Some(offset..offset.checked_add(length_bytes)?)
}

/// Statistics record of a file.
pub(super) struct Statistics {
    pub(super) message_count: u64,
    /// Attachments and metadata records.
    pub(super) extra_count: u64,
    /// Log times of the first and the last message; `None` without messages.
    pub(super) span_ns: Option<(i64, i64)>,
    /// The number of messages of each channel.
    pub(super) by_channel: Vec<(u32, u64)>,
}

pub(super) fn statistics(statistics_body: &[u8]) -> Option<Statistics> {
    let mut fields = Fields::new(statistics_body);
    let message_count = fields.u64()?;
    let (_schemas, _channels) = (fields.u16()?, fields.u32()?);
    let (attachments, metadata, _chunks) = (fields.u32()?, fields.u32()?, fields.u32()?);
    let (first, last) = (fields.u64()?, fields.u64()?);
    let mut entries = Fields::new(fields.sized_bytes()?);
    let mut counts = Vec::new();
    while !entries.rest.is_empty() {
        counts.push((u32::from(entries.u16()?), entries.u64()?));
    }
    let span_ns = i64::try_from(first).ok().zip(i64::try_from(last).ok());
    Some(Statistics {
        message_count,
        extra_count: u64::from(attachments) + u64::from(metadata),
        span_ns: span_ns.filter(|(first, last)| message_count > 0 && first <= last && *last != 0),
        by_channel: counts,
    })
}
