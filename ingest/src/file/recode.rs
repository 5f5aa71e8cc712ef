//! Text in UTF-16, as some programs write tables: it is read through a private copy in UTF-8.

use std::io::{self, Read, Write};

/// The byte order of UTF-16.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Utf16 {
    LittleEndian,
    BigEndian,
}

impl Utf16 {
    /// The byte order of a text, by its mark or by the zeros beside its first letters.
    pub(super) fn of(beginning: &[u8]) -> Option<Self> {
        match beginning {
            [0xff, 0xfe, ..] => Some(Self::LittleEndian),
            [0xfe, 0xff, ..] => Some(Self::BigEndian),
            [a, 0, b, 0, c, 0, ..] if [a, b, c].iter().all(|byte| **byte != 0) => {
                Some(Self::LittleEndian)
            }
            [0, a, 0, b, 0, c, ..] if [a, b, c].iter().all(|byte| **byte != 0) => {
                Some(Self::BigEndian)
            }
            _ => None,
        }
    }

    /// Copies a text as UTF-8, without its mark. What is not UTF-16 becomes the replacement character.
    pub(super) fn recode(self, source: &mut dyn Read, target: &mut dyn Write) -> io::Result<()> {
        const UNITS: usize = 32 << 10;
        let (mut bytes, mut text) = (Vec::new(), String::new());
        // the first half of a character that a block ends with
        let mut kept: Option<u16> = None;
        let mut is_first = true;
        loop {
            bytes.clear();
            let count = Read::take(&mut *source, 2 * UNITS as u64).read_to_end(&mut bytes)?;
            let unit = |pair: &[u8]| match (self, pair) {
                (Self::LittleEndian, [low, high]) => u16::from_le_bytes([*low, *high]),
                (Self::BigEndian, [high, low]) => u16::from_be_bytes([*high, *low]),
                // half a unit at the end of a torn file
                _ => u16::from(b'?'),
            };
            let mut units: Vec<u16> = kept.take().into_iter().collect();
            units.extend(bytes.chunks(2).map(unit));
            let is_last = count < 2 * UNITS;
            if !is_last
                && units
                    .last()
                    .is_some_and(|unit| (0xd800..0xdc00).contains(unit))
            {
                kept = units.pop();
            }
            text.clear();
            let characters = char::decode_utf16(units);
            text.extend(characters.map(|found| found.unwrap_or(char::REPLACEMENT_CHARACTER)));
            let without_mark = text.strip_prefix('\u{feff}').filter(|_| is_first);
            target.write_all(without_mark.unwrap_or(&text).as_bytes())?;
            is_first = false;
            if is_last {
                return Ok(());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_byte_orders_become_the_same_text() {
        let text = format!("t [s];x\n{}", "0;\u{1f69c}\n".repeat(20_000));
        let units: Vec<u16> = text.encode_utf16().collect();
        for (mark, of) in [
            (true, Utf16::LittleEndian),
            (false, Utf16::LittleEndian),
            (true, Utf16::BigEndian),
        ] {
            let marked = mark
                .then_some(0xfeff)
                .into_iter()
                .chain(units.iter().copied());
            let bytes: Vec<u8> = marked
                .flat_map(|unit: u16| match of {
                    Utf16::LittleEndian => unit.to_le_bytes(),
                    Utf16::BigEndian => unit.to_be_bytes(),
                })
                .collect();
            assert_eq!(Utf16::of(&bytes), Some(of));
            let mut recoded = Vec::new();
            of.recode(&mut bytes.as_slice(), &mut recoded).unwrap();
            assert!(recoded == text.as_bytes());
        }
        assert_eq!(Utf16::of(b"time_s,x"), None);
    }
}
