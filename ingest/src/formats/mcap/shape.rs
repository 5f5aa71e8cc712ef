//! Of which fields each kind of record consists, so that the length of a record can be checked
//! against those within it.

use Part::{Bytes, LongSized, Rest, Sized};
use mcap::records::op;

/// One field of a record, as far as it bears on the length.
#[derive(Clone, Copy)]
enum Part {
    /// So many bytes.
    Bytes(u64),
    /// Bytes with their number before them, in four bytes.
    Sized,
    /// The same with eight bytes.
    LongSized,
    /// Whatever is left.
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

/// Whether a body of this length can hold such a record: `None` if not, and whether that is
/// certain. Only the first bytes of the body need to be at hand.
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
            // Not in sight: nothing more can be said, unless the body ends before.
            return (at < body_bytes).then_some(false);
        };
        at = at.saturating_add(count);
    }
    (at == body_bytes).then_some(true)
}

fn field<const N: usize>(body: &[u8], at: u64) -> Option<[u8; N]> {
    let rest = body.get(usize::try_from(at).ok()?..)?;
    rest.first_chunk().copied()
}
