//! Lines of a text file, with their positions, in bounded memory.

use std::{
    io::{self, BufRead, Read},
    ops::Range,
    slice::EscapeAscii,
};

use tipwatch_language::say;

use super::lost::LostRanges;

/// Byte order mark that some programs write before a text in UTF-8.
pub(super) const UTF8_MARK: &[u8] = b"\xef\xbb\xbf";
/// Far above the longest line of a frame.
const MOST_LINE_BYTES: u64 = 4096;

/// Reads lines and knows where each was.
#[derive(Debug)]
pub(super) struct Lines<R> {
    source: R,
    /// The byte after the last line.
    pub(super) end: u64,
    /// The byte at which the last line starts.
    pub(super) start: u64,
    /// The number of the last line, from 1 on.
    number: u64,
    /// Whether the last line was longer than any line of a frame, so that its rest was skipped.
    pub(super) is_cut: bool,
    /// Whether the last line ended with the file instead of with a line break.
    pub(super) is_last: bool,
    buffer: Vec<u8>,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(source: R) -> Self {
        Self {
            source,
            end: 0,
            start: 0,
            number: 0,
            is_cut: false,
            is_last: false,
            buffer: Vec::new(),
        }
    }

    /// Reads the next line; `false` at the end of the file.
    pub(super) fn advance(&mut self) -> io::Result<bool> {
        self.buffer.clear();
        self.start = self.end;
        self.number += 1;
        let mut limited = (&mut self.source).take(MOST_LINE_BYTES);
        let count = limited.read_until(b'\n', &mut self.buffer)? as u64;
        self.end += count;
        self.is_last = !self.buffer.ends_with(b"\n");
        self.is_cut = self.is_last && count == MOST_LINE_BYTES;
        while self.is_cut {
            let available = self.source.fill_buf()?;
            if available.is_empty() {
                break;
            }
            let newline = available.iter().position(|&byte| byte == b'\n');
            let skipped = newline.map_or(available.len(), |at| at + 1);
            self.source.consume(skipped);
            self.end += skipped as u64;
            if newline.is_some() {
                break;
            }
        }
        Ok(count > 0)
    }

    /// The bytes of the file that the last line takes.
    fn range(&self) -> Range<u64> {
        self.start..self.end
    }

    /// Loses the last line.
    pub(super) fn lose(&self, lost: &mut LostRanges, problem: &str) {
        let first = self.number;
        lost.lose(self.range(), say!("line {first}: {}", problem));
    }

    /// Whether the line ended with a line break: a line that ends with the file may be cut off.
    pub(super) fn is_whole(&self) -> bool {
        !self.is_last
    }

    /// The line as it is, at most its first bytes.
    pub(super) fn raw(&self) -> &[u8] {
        &self.buffer
    }

    /// The line without spaces around it and the mark of a text.
    pub(super) fn line(&self) -> &[u8] {
        let line = self.buffer.trim_ascii();
        let without_mark = line.strip_prefix(UTF8_MARK).filter(|_| self.start == 0);
        without_mark.unwrap_or(line)
    }
}

/// A time in decimal seconds as whole nanoseconds, exactly; digits beyond the ninth are cut off.
pub(super) fn seconds(text: &[u8]) -> Option<i64> {
    let (is_negative, text) = match text.strip_prefix(b"-") {
        Some(rest) => (true, rest),
        None => (false, text),
    };
    let dot = text.iter().position(|&byte| byte == b'.');
    let (whole, fraction) = match dot {
        Some(dot) => (text.get(..dot)?, text.get(dot + 1..)?),
        None => (text, &b""[..]),
    };
    if whole.is_empty() || !fraction.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let mut nanos = decimal(whole)?.checked_mul(1_000_000_000)?;
    let mut unit = 100_000_000;
    for digit in fraction.iter().take(9) {
        nanos = nanos.checked_add(i64::from(digit - b'0') * unit)?;
        unit /= 10;
    }
    Some(if is_negative { -nanos } else { nanos })
}

/// A number of decimal digits.
pub(super) fn decimal(text: &[u8]) -> Option<i64> {
    if text.is_empty() {
        return None;
    }
    text.iter().try_fold(0_i64, |number, byte| {
        let digit = byte.is_ascii_digit().then(|| i64::from(byte - b'0'))?;
        number.checked_mul(10)?.checked_add(digit)
    })
}

/// A number of at most eight hexadecimal digits.
pub(super) fn hexadecimal(text: &[u8]) -> Option<u32> {
    if text.is_empty() || text.len() > 8 {
        return None;
    }
    text.iter().try_fold(0_u32, |number, &byte| {
        Some(number << 4 | u32::from(digit(byte)?))
    })
}

/// The value of a hexadecimal digit.
pub(super) fn digit(byte: u8) -> Option<u8> {
    match byte {
        b'0'..=b'9' => Some(byte - b'0'),
        b'a'..=b'f' => Some(byte - b'a' + 10),
        b'A'..=b'F' => Some(byte - b'A' + 10),
        _ => None,
    }
}

/// The beginning of a line, for messages.
pub(super) fn shown(line: &[u8]) -> EscapeAscii<'_> {
    line.get(..line.len().min(40))
        .unwrap_or_default()
        .escape_ascii()
}

/// Words between spaces.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_exact() {
        assert_eq!(
            seconds(b"1436509052.249713"),
            Some(1_436_509_052_249_713_000)
        );
        assert_eq!(seconds(b"-0.5"), Some(-500_000_000));
        assert_eq!(seconds(b"3"), Some(3_000_000_000));
        for wrong in [
            &b""[..],
            b".",
            b"1.2.3",
            b"1e5",
            b"nan",
            b"99999999999999999999",
        ] {
            assert_eq!(seconds(wrong), None);
        }
    }

    #[test]
    fn a_line_without_end_takes_no_memory() {
        let text = [vec![b'x'; 1 << 20], b"\nshort\n".to_vec()].concat();
        let mut lines = Lines::new(&text[..]);
        assert!(lines.advance().unwrap() && lines.is_cut);
        assert!(lines.advance().unwrap());
        assert_eq!(lines.line(), b"short");
        assert_eq!(lines.end, text.len() as u64);
    }
}
