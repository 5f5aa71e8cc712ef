//! The end of what was written to a file.

use std::io::{self, Read, Seek, SeekFrom};

use tipwatch_language::say;

/// A sector of a disk (bytes): fewer equal bytes at the end of a file may be content.
const SECTOR_BYTES: u64 = 512;
const SEARCH_BYTES: u64 = 64 << 10;

/// The part of a file that was written. A file system can lengthen a file before it writes it: after a loss of power, zeros or the
/// bytes of an erased memory (0xff) stand behind what was written, and would complete the record that the loss has cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Written {
    /// Bytes that were written.
    pub bytes: u64,
    /// Bytes behind them.
    pub unwritten: u64,
    /// The value of each byte behind them.
    pub fill: u8,
}

impl Written {
    /// Looks for bytes at the end of a file that were never written.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn of(source: &mut (impl Read + Seek)) -> io::Result<Self> {
        let len = source.seek(SeekFrom::End(0))?;
        let mut end = len;
        let mut fill = None;
        let mut block = Vec::new();
        while end > 0 {
            let count = end.min(SEARCH_BYTES);
            source.seek(SeekFrom::Start(end - count))?;
            block.clear();
            source.by_ref().take(count).read_to_end(&mut block)?;
            end -= count;
            let fill = *fill.get_or_insert(block.last().copied().unwrap_or(0));
            if let Some(last) = block.iter().rposition(|&byte| byte != fill) {
                end += last as u64 + 1;
                break;
            }
        }
        let fill = fill.unwrap_or(0);
        let is_cut = matches!(fill, 0 | 0xff) && len - end >= SECTOR_BYTES && end > 0;
        let bytes = if is_cut { end } else { len };
        Ok(Self {
            bytes,
            unwritten: len - bytes,
            fill,
        })
    }

    /// The sentence about the bytes that were never written, if there are any.
    #[must_use]
    pub fn note(self) -> Option<String> {
        let count = self.unwritten;
        let fill = format!("0x{:02x}", self.fill);
        (count > 0).then(|| {
            say!("{count} bytes at the end of the file, each {fill}, were never written and are not read")
        })
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    #[test]
    fn a_sector_of_equal_bytes_was_never_written() {
        let of = |fill: u8, count: usize| {
            let file = [&[fill, 7][..], &vec![fill; count]].concat();
            let written = Written::of(&mut Cursor::new(file)).unwrap();
            assert_eq!(written.note().is_some(), written.unwritten > 0);
            (written.bytes, written.unwritten)
        };
        for fill in [0, 0xff] {
            assert_eq!(of(fill, 0), (2, 0));
            assert_eq!(of(fill, 511), (513, 0));
            assert_eq!(of(fill, 512), (2, 512));
            assert_eq!(of(fill, 200_000), (2, 200_000));
        }
        assert_eq!(of(b' ', 200_000), (200_002, 0));
        let empty = Written::of(&mut Cursor::new(vec![0_u8; 1000])).unwrap();
        assert_eq!((empty.bytes, empty.note()), (1000, None));
    }
}
