//! The field layout of each record kind, to check a record's length against the lengths inside it.
//!
//! A record may be longer than its fields: later versions of the format append fields, which readers pass over.

use Part::{Bytes, LongSized, Rest, Sized};
use mcap::records::op;

/// One field of a record, as far as it affects the length.
#[derive(Clone, Copy)]
enum Part {
    /// A fixed number of bytes.
    Bytes(u64),
    /// Bytes preceded by their count in four bytes.
    Sized,
    /// Bytes preceded by their count in eight bytes.
    LongSized,
    /// All remaining bytes.
    Rest,
}

fn shape(opcode: u8) -> Option<&'static [Part]> {
    Some(match opcode {
        op::HEADER => &[Sized, Sized],
        op::FOOTER => &[Bytes(20)],
        op::SCHEMA => &[Bytes(2), Sized, Sized, Sized],
        op::CHANNEL => &[Bytes(4), Sized, Sized, Sized],
        op::MESSAGE => &[Bytes(22), Rest],
        op::CHUNK => &[Bytes(28), Sized, LongSized],
        op::MESSAGE_INDEX => &[Bytes(2), Sized],
        op::CHUNK_INDEX => &[Bytes(32), Sized, Bytes(8), Sized, Bytes(16)],
        op::ATTACHMENT => &[Bytes(16), Sized, Sized, LongSized, Bytes(4)],
        op::ATTACHMENT_INDEX => &[Bytes(40), Sized, Sized],
        op::STATISTICS => &[Bytes(42), Sized],
        op::METADATA => &[Sized, Sized],
        op::METADATA_INDEX => &[Bytes(16), Sized],
        op::SUMMARY_OFFSET => &[Bytes(17)],
        op::DATA_END => &[Bytes(4)],
        _ => return None,
    })
}

/// `None` if a body of this length cannot be such a record, else whether that is certain: its fields end where it ends.
/// Only the first bytes of the body are needed.
pub(super) fn fits(opcode: u8, body: &[u8], body_bytes: u64) -> Option<bool> {
    let Some(parts) = shape(opcode) else {
        return Some(false);
    };
    let mut at: u64 = 0;
    for part in parts {
        let count = match part {
            Bytes(count) => Some(*count),
            Sized => field(body, at).map(|bytes| u64::from(u32::from_le_bytes(bytes)) + 4),
            LongSized => field(body, at).map(|bytes| u64::from_le_bytes(bytes).saturating_add(8)),
            Rest => return (at <= body_bytes).then_some(false),
        };
        let Some(count) = count else {
            // Beyond the bytes at hand: nothing more can be checked, unless the body ends earlier.
            return (at < body_bytes).then_some(false);
        };
        at = at.saturating_add(count);
    }
    (at <= body_bytes).then_some(at == body_bytes)
}

fn field<const N: usize>(body: &[u8], at: u64) -> Option<[u8; N]> {
    let rest = body.get(usize::try_from(at).ok()?..)?;
    rest.first_chunk().copied()
}
