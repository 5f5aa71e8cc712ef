//! The wire format of protobuf: numbered fields in any order, each of one of four wire types.

/// One encoded field value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Item<'a> {
    Varint(u64),
    Fixed64([u8; 8]),
    Bytes(&'a [u8]),
    Fixed32([u8; 4]),
}

/// The fields of a message; ends with `None` at the first unreadable one.
pub(super) fn items(bytes: &[u8]) -> impl Iterator<Item = Option<(u64, Item<'_>)>> {
    let mut rest = Some(bytes);
    std::iter::from_fn(move || {
        let bytes = rest.filter(|bytes| !bytes.is_empty())?;
        let next = item(bytes);
        rest = next.map(|(_, _, rest)| rest);
        Some(next.map(|(number, item, _)| (number, item)))
    })
}

fn item(bytes: &[u8]) -> Option<(u64, Item<'_>, &[u8])> {
    let (tag, rest) = varint(bytes)?;
    let (item, rest) = match tag & 7 {
        0 => varint(rest).map(|(value, rest)| (Item::Varint(value), rest))?,
        1 => rest
            .split_first_chunk()
            .map(|(value, rest)| (Item::Fixed64(*value), rest))?,
        2 => {
            let (count, rest) = varint(rest)?;
            let (value, rest) = rest.split_at_checked(usize::try_from(count).ok()?)?;
            (Item::Bytes(value), rest)
        }
        5 => rest
            .split_first_chunk()
            .map(|(value, rest)| (Item::Fixed32(*value), rest))?,
        // Groups are deprecated and no longer written.
        _ => return None,
    };
    Some((tag >> 3, item, rest))
}

/// Seven bits per byte, least significant first.
fn varint(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let mut value: u64 = 0;
    for (index, &byte) in bytes.iter().enumerate().take(10) {
        value |= u64::from(byte & 0x7f) << (7 * index);
        if byte & 0x80 == 0 {
            return Some((value, bytes.get(index + 1..)?));
        }
    }
    None
}

/// Encoding of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    F64,
    F32,
    I64,
    U64,
    I32,
    U32,
    Bool,
    Fixed64,
    Fixed32,
    SignedFixed64,
    SignedFixed32,
    ZigZag,
}

impl Number {
    /// The number in an item, if the wire type fits.
    pub(super) fn value(self, item: Item<'_>) -> Option<f64> {
        Some(match (self, item) {
            (Self::F64, Item::Fixed64(bytes)) => f64::from_le_bytes(bytes),
            (Self::F32, Item::Fixed32(bytes)) => f64::from(f32::from_le_bytes(bytes)),
            (Self::Fixed64, Item::Fixed64(bytes)) => u64::from_le_bytes(bytes) as f64,
            (Self::Fixed32, Item::Fixed32(bytes)) => f64::from(u32::from_le_bytes(bytes)),
            (Self::SignedFixed64, Item::Fixed64(bytes)) => i64::from_le_bytes(bytes) as f64,
            (Self::SignedFixed32, Item::Fixed32(bytes)) => f64::from(i32::from_le_bytes(bytes)),
            (Self::I64, Item::Varint(value)) => value as i64 as f64,
            (Self::U64, Item::Varint(value)) => value as f64,
            (Self::I32, Item::Varint(value)) => f64::from(value as i32),
            (Self::U32, Item::Varint(value)) => f64::from(value as u32),
            (Self::Bool, Item::Varint(value)) => f64::from(u8::from(value != 0)),
            (Self::ZigZag, Item::Varint(value)) => {
                ((value >> 1) as i64 ^ -((value & 1) as i64)) as f64
            }
            _ => return None,
        })
    }

    /// Calls `take` for each number of a packed array; `None` if bytes are left over.
    pub(super) fn unpack(self, packed: &[u8], mut take: impl FnMut(f64)) -> Option<()> {
        let mut rest = packed;
        while !rest.is_empty() {
            let (item, next) = match self {
                Self::F64 | Self::Fixed64 | Self::SignedFixed64 => {
                    let (bytes, next) = rest.split_first_chunk()?;
                    (Item::Fixed64(*bytes), next)
                }
                Self::F32 | Self::Fixed32 | Self::SignedFixed32 => {
                    let (bytes, next) = rest.split_first_chunk()?;
                    (Item::Fixed32(*bytes), next)
                }
                _ => {
                    let (value, next) = varint(rest)?;
                    (Item::Varint(value), next)
                }
            };
            take(self.value(item)?);
            rest = next;
        }
        Some(())
    }
}
