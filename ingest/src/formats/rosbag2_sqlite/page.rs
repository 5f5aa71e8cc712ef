//! Parses pages of an SQLite file directly, for databases that the library cannot read.
//!
//! Only table leaves are read. Inconsistent cells are skipped; no length beyond the file causes an
//! allocation.

/// The page size of a database, from its first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct PageSize {
    /// Size of a page.
    pub(super) bytes: u64,
    /// Usable size of a page.
    usable: usize,
}

const LEAF_OF_TABLE: u8 = 0x0d;
const INTERIOR_OF_TABLE: u8 = 0x05;
const LEAF_OF_INDEX: u8 = 0x0a;
const INTERIOR_OF_INDEX: u8 = 0x02;
/// The first page begins with the header of the file.
const FILE_HEADER_BYTES: usize = 100;
const LEAF_HEADER_BYTES: usize = 8;
/// Columns of the widest table that is looked for.
const MOST_COLUMNS: usize = 8;

impl PageSize {
    /// Parses the first 32 bytes of a file; `None` if they are invalid.
    pub(super) fn parse(header: &[u8]) -> Option<Self> {
        let bytes = match u16::from_be_bytes(*header.get(16..)?.first_chunk()?) {
            1 => 65536,
            bytes => u64::from(bytes),
        };
        let reserved = usize::from(*header.get(20)?);
        let usable = (bytes as usize).checked_sub(reserved)?;
        let is_sound = bytes.is_power_of_two() && bytes >= 512 && usable >= 480;
        is_sound.then_some(Self { bytes, usable })
    }

    /// Returns the number of bytes of a payload that the cell itself holds; the others are on overflow pages.
    fn local_bytes(self, payload_bytes: u64) -> usize {
        let usable = self.usable as u64;
        let largest = self.most_local_bytes() as u64;
        if payload_bytes <= largest {
            return payload_bytes as usize;
        }
        let smallest = (usable - 12) * 32 / 255 - 23;
        let fitting = smallest + (payload_bytes - smallest) % (usable - 4);
        (if fitting <= largest {
            fitting
        } else {
            smallest
        }) as usize
    }

    /// The longest payload that is on one page.
    pub(super) fn most_local_bytes(self) -> usize {
        self.usable - 35
    }

    /// The content of an overflow page: the number of the next page, and payload bytes.
    pub(super) fn overflow(self, page: &[u8]) -> Option<(u32, &[u8])> {
        let next = u32::from_be_bytes(*page.first_chunk()?);
        Some((next, page.get(4..self.usable)?))
    }
}

/// The kind of a page, as far as its first byte shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PageKind {
    Leaf,
    OtherTree,
    /// Not a tree node: an overflow page, unused, or damaged.
    NoTree,
}

fn tree_header(page: &[u8], is_first: bool) -> &[u8] {
    let start = if is_first { FILE_HEADER_BYTES } else { 0 };
    page.get(start..).unwrap_or_default()
}

pub(super) fn kind(page: &[u8], is_first: bool) -> PageKind {
    let header = tree_header(page, is_first);
    match header.first() {
        Some(&LEAF_OF_TABLE) => PageKind::Leaf,
        Some(&(INTERIOR_OF_TABLE | LEAF_OF_INDEX | INTERIOR_OF_INDEX)) => PageKind::OtherTree,
        _ => PageKind::NoTree,
    }
}

/// One row of a table, as far as it is on this page.
pub(super) struct Cell<'p> {
    pub(super) row_id: i64,
    pub(super) payload_bytes: u64,
    pub(super) local: &'p [u8],
    /// The overflow page on which the payload continues.
    pub(super) overflow: Option<u32>,
}

impl Cell<'_> {
    /// The place in the page at which it ends.
    pub(super) fn end(&self, page: &[u8]) -> usize {
        self.local.as_ptr_range().end as usize - page.as_ptr() as usize
    }
}

/// The rows on a leaf, in order; inconsistent ones are omitted.
pub(super) fn cells(
    page: &[u8],
    is_first: bool,
    size: PageSize,
) -> impl Iterator<Item = Cell<'_>> + use<'_> {
    let header = tree_header(page, is_first);
    let count = header
        .get(3..)
        .and_then(<[u8]>::first_chunk)
        .map_or(0, |bytes| usize::from(u16::from_be_bytes(*bytes)));
    let pointers = header.get(LEAF_HEADER_BYTES..).unwrap_or_default();
    let (pointers, _) = pointers.as_chunks::<2>();
    let pointers = pointers.iter().take(count);
    pointers.filter_map(move |pointer| {
        let at = usize::from(u16::from_be_bytes(*pointer));
        cell(page.get(..size.usable)?.get(at..)?, size)
    })
}

fn cell(bytes: &[u8], size: PageSize) -> Option<Cell<'_>> {
    let (payload_bytes, rest) = varint(bytes)?;
    let (row_id, rest) = varint(rest)?;
    let payload_bytes = u64::try_from(payload_bytes).ok()?;
    let local_bytes = size.local_bytes(payload_bytes);
    let (local, rest) = rest.split_at_checked(local_bytes)?;
    let overflow = match payload_bytes > local_bytes as u64 {
        true => Some(u32::from_be_bytes(*rest.first_chunk()?)),
        false => None,
    };
    Some(Cell {
        row_id,
        payload_bytes,
        local,
        overflow,
    })
}

/// A value of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value<'p> {
    Null,
    Integer(i64),
    Real,
    Text(&'p [u8]),
    Blob(&'p [u8]),
}

/// The type and position of a column's value.
#[derive(Clone, Copy)]
struct Column {
    serial_type: i64,
    start: usize,
    bytes: usize,
}

/// The columns of a row, by the header of its payload.
pub(super) struct Columns {
    columns: [Column; MOST_COLUMNS],
    count: usize,
}

impl Columns {
    /// Parses the header; the values may still be missing. `None` if they would not fill the
    /// payload.
    pub(super) fn parse(local: &[u8], payload_bytes: u64) -> Option<Self> {
        let (header_bytes, mut rest) = varint(local)?;
        let header_bytes = usize::try_from(header_bytes).ok()?;
        let before = local.len() - rest.len();
        rest = rest.get(..header_bytes.checked_sub(before)?)?;
        let empty = Column {
            serial_type: 0,
            start: 0,
            bytes: 0,
        };
        let mut columns = [empty; MOST_COLUMNS];
        let mut count = 0;
        let mut start = header_bytes;
        while !rest.is_empty() {
            let (serial_type, next) = varint(rest)?;
            rest = next;
            let bytes = value_bytes(serial_type)?;
            *columns.get_mut(count)? = Column {
                serial_type,
                start,
                bytes,
            };
            count += 1;
            start = start.checked_add(bytes)?;
        }
        (start as u64 == payload_bytes).then_some(Self { columns, count })
    }

    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Whether a column is a blob.
    pub(super) fn is_blob(&self, index: usize) -> bool {
        self.columns
            .get(index)
            .is_some_and(|column| column.serial_type >= 12 && column.serial_type % 2 == 0)
    }

    /// The value of a column; `None` if the payload ends before it.
    pub(super) fn value<'p>(&self, index: usize, payload: &'p [u8]) -> Option<Value<'p>> {
        let column = self.columns.get(..self.count)?.get(index)?;
        let end = column.start.checked_add(column.bytes)?;
        let bytes = payload.get(column.start..end)?;
        Some(match column.serial_type {
            0 => Value::Null,
            1..=6 => Value::Integer(integer(bytes)),
            7 => Value::Real,
            8 => Value::Integer(0),
            9 => Value::Integer(1),
            other if other % 2 == 0 => Value::Blob(bytes),
            _ => Value::Text(bytes),
        })
    }
}

fn value_bytes(serial_type: i64) -> Option<usize> {
    Some(match serial_type {
        0 | 8 | 9 => 0,
        1..=4 => serial_type as usize,
        5 => 6,
        6 | 7 => 8,
        12.. => usize::try_from((serial_type - 12) / 2).ok()?,
        _ => return None,
    })
}

/// A signed big-endian integer of up to eight bytes.
fn integer(bytes: &[u8]) -> i64 {
    let is_negative = bytes.first().is_some_and(|byte| byte & 0x80 != 0);
    let start = if is_negative { -1 } else { 0 };
    bytes
        .iter()
        .fold(start, |value, byte| (value << 8) | i64::from(*byte))
}

/// A varint of one to nine bytes, and the rest.
fn varint(bytes: &[u8]) -> Option<(i64, &[u8])> {
    let mut value: i64 = 0;
    for index in 0..8 {
        let byte = *bytes.get(index)?;
        value = (value << 7) | i64::from(byte & 0x7f);
        if byte & 0x80 == 0 {
            return Some((value, bytes.get(index + 1..)?));
        }
    }
    let last = *bytes.get(8)?;
    Some(((value << 8) | i64::from(last), bytes.get(9..)?))
}
