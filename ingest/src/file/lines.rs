//! Lines of a text, in bounded memory.

use std::io::{self, BufRead, Read};

/// Longest line; a longer one is no row.
const MOST_LINE_BYTES: u64 = 16 << 20;
/// Bytes of a line that is too long which are kept for its description.
const SHOWN_BYTES: usize = 40;

/// A text, or its first line, without the mark of UTF-8.
pub(super) fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

/// Passes on each line. Of one that is too long, only the beginning is, with dots that make it no row.
pub(super) fn each_line(
    source: &mut (impl BufRead + ?Sized),
    take: &mut dyn FnMut(&[u8]) -> io::Result<()>,
) -> io::Result<()> {
    let mut line = Vec::new();
    loop {
        line.clear();
        let mut limited = Read::take(&mut *source, MOST_LINE_BYTES);
        if limited.read_until(b'\n', &mut line)? == 0 {
            return Ok(());
        }
        if limited.limit() == 0 && !line.ends_with(b"\n") {
            source.skip_until(b'\n')?;
            line.truncate(SHOWN_BYTES);
            line.extend(b"...\n");
        }
        take(&line)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_without_an_end_takes_no_memory_without_one() {
        let long = vec![b'{'; MOST_LINE_BYTES as usize + 7];
        let text = [b"a\n", &long[..], b"\nb"].concat();
        let mut lengths = Vec::new();
        let seen = each_line(&mut text.as_slice(), &mut |line| {
            lengths.push(line.len());
            Ok(())
        });
        seen.unwrap();
        assert_eq!(lengths, [2, SHOWN_BYTES + 4, 1]);
    }
}
