//! The parts of a 29-bit identifier.

use crate::frame::CanId;

/// First format of broadcasts: below it, the second byte of the identifier is a destination.
const FIRST_BROADCAST_FORMAT: u8 = 240;

/// A 29-bit identifier by J1939-21.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identifier {
    /// 0 is the most urgent, 7 the least.
    pub priority: u8,
    /// Parameter group number, without the destination.
    pub pgn: u32,
    /// Address of the sender.
    pub source: u8,
    /// Address of the receiver; `None` for messages to all.
    pub destination: Option<u8>,
}

impl Identifier {
    /// The parts of an identifier; `None` for 11 bits.
    #[must_use]
    pub fn of(id: CanId) -> Option<Self> {
        id.is_extended.then(|| {
            let [first, format, specific, source] = id.raw.to_be_bytes();
            // data page and extended data page
            let page = u32::from(first & 3);
            let is_addressed = format < FIRST_BROADCAST_FORMAT;
            let low = if is_addressed { 0 } else { specific };
            Self {
                priority: first >> 2 & 7,
                pgn: page << 16 | u32::from(format) << 8 | u32::from(low),
                source,
                destination: is_addressed.then_some(specific),
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_identifiers_have_their_parts() {
        // the engine's speed, and a request to one receiver
        let engine = Identifier::of(CanId::extended(0x0cf0_0400)).unwrap();
        assert_eq!((engine.priority, engine.pgn, engine.source), (3, 61_444, 0));
        assert_eq!(engine.destination, None);
        let request = Identifier::of(CanId::extended(0x18ea_21f9)).unwrap();
        assert_eq!(
            (request.pgn, request.source, request.destination),
            (59_904, 0xf9, Some(0x21))
        );
        assert_eq!(Identifier::of(CanId::standard(0x123)), None);
        // data page 1
        assert_eq!(
            Identifier::of(CanId::extended(0x19f0_0a03)).unwrap().pgn,
            0x1f00a
        );
    }
}
