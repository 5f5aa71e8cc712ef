//! Parses record headers of bags: fields of the form `name=value`, each preceded by its length,
//! then the length of the data.

use crate::file::BAG_MAGIC;

/// Values of the field `op`.
pub(super) mod op {
    pub(crate) const MESSAGE: u8 = 2;
    pub(crate) const BAG_HEADER: u8 = 3;
    pub(crate) const INDEX: u8 = 4;
    pub(crate) const CHUNK: u8 = 5;
    pub(crate) const CHUNK_INFO: u8 = 6;
    pub(crate) const CONNECTION: u8 = 7;
}

/// Offset of the first record.
pub(super) const FIRST_RECORD: u64 = BAG_MAGIC.len() as u64;
/// Bytes in which the header of any record should end.
pub(super) const HEAD_BYTES: usize = 2048;
const LENGTH_BYTES: usize = 4;
/// The smallest header has only the field `op`.
const SMALLEST_HEADER_BYTES: usize = 8;

/// The header fields that are used.
#[derive(Default)]
pub(super) struct Header<'a> {
    pub(super) op: u8,
    pub(super) connection: Option<u32>,
    pub(super) time_ns: Option<i64>,
    /// Size of the decompressed chunk.
    pub(super) size: Option<u32>,
    pub(super) count: Option<u32>,
    pub(super) compression: Option<&'a [u8]>,
    pub(super) topic: Option<&'a [u8]>,
    pub(super) index_position: Option<u64>,
    pub(super) connection_count: Option<u32>,
    pub(super) chunk_count: Option<u32>,
    pub(super) chunk_position: Option<u64>,
    pub(super) start_ns: Option<i64>,
    pub(super) end_ns: Option<i64>,
}

/// The header at the front of `bytes`, the length of its data, and the offset of the data. `None`
/// if there is no header of a known kind.
#[inline]
pub(super) fn frame(bytes: &[u8]) -> Option<(Header<'_>, u32, u64)> {
    let header_bytes = length(bytes)?;
    let data_at = LENGTH_BYTES.checked_add(header_bytes)?;
    if header_bytes < SMALLEST_HEADER_BYTES || data_at > bytes.len() {
        return None;
    }
    let data_bytes = bytes.get(data_at..)?.first_chunk()?;
    let header = parse(bytes.get(LENGTH_BYTES..data_at)?)?;
    let data_bytes = u32::from_le_bytes(*data_bytes);
    Some((header, data_bytes, (data_at + LENGTH_BYTES) as u64))
}

/// Splits off the first record: its header, the record and the bytes after it.
#[inline]
pub(super) fn split_first(bytes: &[u8]) -> Option<(Header<'_>, &[u8], &[u8])> {
    let (header, data_bytes, header_bytes) = frame(bytes)?;
    let length = usize::try_from(header_bytes + u64::from(data_bytes)).ok()?;
    let (record, rest) = bytes.split_at_checked(length)?;
    Some((header, record, rest))
}

/// The header of a whole record and its data.
#[inline]
pub(super) fn split(record: &[u8]) -> Option<(Header<'_>, &[u8])> {
    let (header, data_bytes, header_bytes) = frame(record)?;
    let data = record.get(usize::try_from(header_bytes).ok()?..)?;
    Some((header, data.get(..data_bytes as usize)?))
}

/// Calls `take` with the name and value of each field; `None` if the fields do not fill `bytes`.
#[inline]
pub(super) fn fields<'a>(
    mut bytes: &'a [u8],
    mut take: impl FnMut(&'a [u8], &'a [u8]),
) -> Option<()> {
    while !bytes.is_empty() {
        let field_bytes = length(bytes)?;
        let (field, rest) = bytes.get(LENGTH_BYTES..)?.split_at_checked(field_bytes)?;
        let equals = field.iter().position(|&byte| byte == b'=')?;
        take(field.get(..equals)?, field.get(equals + 1..)?);
        bytes = rest;
    }
    Some(())
}

fn parse(bytes: &[u8]) -> Option<Header<'_>> {
    let mut header = Header::default();
    let mut is_sound = true;
    fields(bytes, |name, value| {
        is_sound &= header.take(name, value).is_some();
    })?;
    let is_complete = match header.op {
        op::MESSAGE => header.connection.is_some() && header.time_ns.is_some(),
        op::BAG_HEADER => header.index_position.is_some(),
        op::INDEX => header.connection.is_some() && header.count.is_some(),
        op::CHUNK => header.compression.is_some() && header.size.is_some(),
        op::CHUNK_INFO => header.chunk_position.is_some(),
        op::CONNECTION => header.connection.is_some() && header.topic.is_some(),
        _ => false,
    };
    (is_sound && is_complete).then_some(header)
}

impl<'a> Header<'a> {
    #[inline]
    fn take(&mut self, name: &[u8], value: &'a [u8]) -> Option<()> {
        match name {
            b"op" => self.op = *value.first().filter(|_| value.len() == 1)?,
            b"conn" => self.connection = Some(u32_from(value)?),
            b"time" => self.time_ns = Some(time_ns_from(value)?),
            b"size" => self.size = Some(u32_from(value)?),
            b"count" => self.count = Some(u32_from(value)?),
            b"compression" => self.compression = Some(value),
            b"topic" => self.topic = Some(value),
            b"index_pos" => self.index_position = Some(u64_from(value)?),
            b"conn_count" => self.connection_count = Some(u32_from(value)?),
            b"chunk_count" => self.chunk_count = Some(u32_from(value)?),
            b"chunk_pos" => self.chunk_position = Some(u64_from(value)?),
            b"start_time" => self.start_ns = Some(time_ns_from(value)?),
            b"end_time" => self.end_ns = Some(time_ns_from(value)?),
            _ => {}
        }
        Some(())
    }
}

fn length(bytes: &[u8]) -> Option<usize> {
    let bytes = bytes.first_chunk()?;
    usize::try_from(u32::from_le_bytes(*bytes)).ok()
}

fn u32_from(value: &[u8]) -> Option<u32> {
    value.try_into().ok().map(u32::from_le_bytes)
}

fn u64_from(value: &[u8]) -> Option<u64> {
    value.try_into().ok().map(u64::from_le_bytes)
}

/// Seconds, then nanoseconds.
fn time_ns_from(value: &[u8]) -> Option<i64> {
    let (seconds, nanoseconds) = value.split_at_checked(4)?;
    // At most 2^32 seconds, so this does not overflow.
    Some(i64::from(u32_from(seconds)?) * 1_000_000_000 + i64::from(u32_from(nanoseconds)?))
}
