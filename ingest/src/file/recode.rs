//! Texts that are read through a private copy in another form: those in UTF-16, and those that are a table or frames in other
//! words.

use std::io::{self, BufRead, Read, Seek, Write};

use tipwatch_language::word;

use super::{annotated_csv, format::Format, frame_table::FrameTable, json_lines};

/// Conversion of a text to one that a reader takes, by its source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Recoding {
    /// Text in UTF-16 to UTF-8.
    Utf16(Utf16),
    /// Lines of JSON to a table.
    JsonLines,
    /// Annotated CSV of InfluxDB to a table.
    AnnotatedCsv,
    /// A table of CAN frames to text of candump.
    Frames(FrameTable),
}

impl Recoding {
    /// Finds the conversion that a file needs by its first bytes; `None` if it needs none.
    pub(super) fn of(first_bytes: &[u8], is_whole: bool) -> Option<Self> {
        if let Some(order) = Utf16::of(first_bytes) {
            Some(Self::Utf16(order))
        } else if json_lines::is_beginning(first_bytes, is_whole) {
            Some(Self::JsonLines)
        } else if annotated_csv::is_beginning(first_bytes) {
            Some(Self::AnnotatedCsv)
        } else {
            FrameTable::of(first_bytes).map(Self::Frames)
        }
    }

    /// Returns the format of the result, if its first bytes need not decide.
    pub(super) fn format(self) -> Option<Format> {
        match self {
            Self::Utf16(_) | Self::JsonLines => None,
            Self::AnnotatedCsv => Some(Format::Csv),
            Self::Frames(_) => Some(Format::Candump),
        }
    }

    /// Converts the first bytes, without the incomplete character or line at their end.
    pub(super) fn beginning(self, first_bytes: &[u8], is_whole: bool) -> Vec<u8> {
        let end = match self {
            Self::Utf16(_) => first_bytes.len() & !1,
            _ if is_whole => first_bytes.len(),
            _ => first_bytes
                .iter()
                .rposition(|&byte| byte == b'\n')
                .map_or(0, |at| at + 1),
        };
        let mut text = Vec::new();
        let whole = first_bytes.get(..end).unwrap_or_default();
        // reading from memory and writing to it cannot fail
        let _ = self.recode(&mut io::Cursor::new(whole), &mut text);
        text
    }

    /// Copies a text in its new form. Describes the parts left out.
    pub(super) fn recode(
        self,
        source: &mut (impl BufRead + Seek),
        target: &mut dyn Write,
    ) -> io::Result<Vec<String>> {
        match self {
            Self::Utf16(order) => order.recode(source, target),
            Self::JsonLines => return json_lines::recode(source, target),
            Self::AnnotatedCsv => annotated_csv::recode(source, target),
            Self::Frames(table) => table.recode(source, target),
        }?;
        Ok(Vec::new())
    }

    /// Returns the note that says which text or table the positions in the log refer to.
    pub(super) fn note(self) -> &'static str {
        match self {
            Self::Utf16(_) => {
                word!("the text is in UTF-16: byte positions refer to the same text in UTF-8")
            }
            Self::JsonLines => {
                word!("each line is a JSON object: positions refer to the same rows as a table")
            }
            Self::AnnotatedCsv => word!(
                "annotated CSV of InfluxDB: positions refer to a table of its signals in the order of their times"
            ),
            Self::Frames(_) => word!(
                "the table has CAN frames: positions refer to the same frames as text of candump"
            ),
        }
    }
}

/// The byte order of UTF-16.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Utf16 {
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
