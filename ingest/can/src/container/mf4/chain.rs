//! Measured data: one stream of bytes in one block or many, compressed or not.

use std::io::{self, Read, Seek};

use flate2::read::ZlibDecoder;
use tipwatch_language::{say, word};

use super::block::{BlockFile, HEADER_BYTES, Header};
use crate::{
    bits::{array_at, u16_at, u32_at, u64_at},
    container::lost::LostRanges,
};

/// Uncompressed blocks are read in pieces of this size.
const PIECE_BYTES: u64 = 1 << 20;
/// The standard allows 4 MiB.
const MOST_UNPACKED_BYTES: u64 = 64 << 20;
/// Type, parameter and lengths of a compressed block.
const DZ_HEADER_BYTES: u64 = 24;

/// A piece of a stream.
#[derive(Debug, Clone)]
struct Piece {
    /// Position of its first byte in the stream.
    start: u64,
    len: u64,
    file_at: u64,
    packed_len: u64,
    packing: Packing,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Packing {
    None,
    Deflate,
    /// Columns of records of so many bytes, one after the other.
    Transposed(u32),
}

/// A stream of bytes of which parts may be lost.
#[derive(Debug, Default)]
pub(super) struct Stream {
    pieces: Vec<Piece>,
    cached: Option<usize>,
    cache: Vec<u8>,
    scratch: Vec<u8>,
    pub(super) len: u64,
}

/// Bytes of a stream.
pub(super) enum Bytes<'s> {
    Found(&'s [u8]),
    /// Bytes that are lost, up to this position.
    LostUntil(u64),
    End,
}

impl Stream {
    /// Finds the blocks of a stream.
    pub(super) fn open<R: Read + Seek>(
        file: &mut BlockFile<R>,
        at: u64,
        is_finalised: bool,
        lost: &mut LostRanges,
    ) -> io::Result<Self> {
        let mut stream = Self::default();
        let mut next = at;
        // every block of a list has a header
        let mut lists_left = file.len / HEADER_BYTES;
        while next != 0 && lists_left > 0 {
            lists_left -= 1;
            let header = match file.header(next)? {
                Ok(header) => header,
                Err(reason) => {
                    lost.lose(next.min(file.len)..file.len, reason);
                    break;
                }
            };
            match &header.kind {
                b"DL" | b"LD" => next = stream.list(file, header, is_finalised, lost)?,
                b"HL" => {
                    next = file.block(next, *b"HL")?.map_or(0, |block| block.link(0));
                }
                _ => {
                    stream.data(file, header, is_finalised, lost)?;
                    break;
                }
            }
        }
        Ok(stream)
    }

    /// Takes the blocks of a list and returns the next list.
    fn list<R: Read + Seek>(
        &mut self,
        file: &mut BlockFile<R>,
        header: Header,
        is_finalised: bool,
        lost: &mut LostRanges,
    ) -> io::Result<u64> {
        let links = header.link_count.min(file.len / 8);
        let bytes = file.bytes(header.at + HEADER_BYTES, links * 8)?;
        let links: Vec<u64> = (0..bytes.len() / 8)
            .filter_map(|i| u64_at(&bytes, i * 8))
            .collect();
        let (next, mut blocks) = match links.split_first() {
            Some((next, blocks)) => (*next, blocks),
            None => return Ok(0),
        };
        if header.kind == *b"LD" {
            // blocks of invalidation bits may follow those of data
            let at = header.at + HEADER_BYTES + header.link_count * 8;
            let fields = file.bytes(at, 8)?;
            let (flags, count) = (
                u32_at(&fields, 0).unwrap_or(0),
                u32_at(&fields, 4).unwrap_or(0),
            );
            if flags & 1 << 31 != 0 {
                blocks = blocks.get(..count as usize).unwrap_or(blocks);
            }
        }
        for &block in blocks.iter().filter(|block| **block != 0) {
            match file.header(block)? {
                Ok(header) => self.data(file, header, is_finalised, lost)?,
                Err(reason) => lost.lose_link(block, file.len, reason),
            }
        }
        Ok(next)
    }

    fn data<R: Read + Seek>(
        &mut self,
        file: &mut BlockFile<R>,
        header: Header,
        is_finalised: bool,
        lost: &mut LostRanges,
    ) -> io::Result<()> {
        let at = header.at + HEADER_BYTES;
        if header.kind == *b"DZ" {
            return self.compressed(file, header, lost);
        }
        if !matches!(&header.kind, b"DT" | b"SD" | b"DV" | b"RD") {
            let kind = header.kind.escape_ascii();
            lost.lose(
                header.at..at,
                say!("expected a block of data, found ##{kind}"),
            );
            return Ok(());
        }
        let mut len = header.len - HEADER_BYTES;
        if !is_finalised && len == 0 || at + len > file.len {
            if is_finalised {
                lost.lose(
                    header.at..file.len,
                    word!("the file ends within a block of data"),
                );
            }
            len = file.len.saturating_sub(at);
        }
        let mut start = 0;
        while start < len {
            let piece = PIECE_BYTES.min(len - start);
            self.push(Piece {
                start: 0,
                len: piece,
                file_at: at + start,
                packed_len: piece,
                packing: Packing::None,
            });
            start += piece;
        }
        Ok(())
    }

    fn compressed<R: Read + Seek>(
        &mut self,
        file: &mut BlockFile<R>,
        header: Header,
        lost: &mut LostRanges,
    ) -> io::Result<()> {
        let at = header.at + HEADER_BYTES;
        let fields = file.bytes(at, DZ_HEADER_BYTES)?;
        let piece = || {
            let [_, _, kind, _]: [u8; 4] = array_at(&fields, 0)?;
            let parameter = u32_at(&fields, 4)?;
            let packing = match kind {
                0 => Packing::Deflate,
                1 => Packing::Transposed(parameter),
                _ => return None,
            };
            let len = u64_at(&fields, 8)?;
            (len <= MOST_UNPACKED_BYTES).then_some(Piece {
                start: 0,
                len,
                file_at: at + DZ_HEADER_BYTES,
                packed_len: u64_at(&fields, 16)?.min(file.len),
                packing,
            })
        };
        match piece() {
            Some(piece) => self.push(piece),
            None => lost.lose(
                header.at..(header.at + header.len).min(file.len),
                word!("expected a deflated block of at most 64 MiB"),
            ),
        }
        Ok(())
    }

    fn push(&mut self, mut piece: Piece) {
        piece.start = self.len;
        self.len = self.len.saturating_add(piece.len);
        self.pieces.push(piece);
    }

    /// Bytes of the stream, which may span blocks.
    pub(super) fn read<R: Read + Seek>(
        &mut self,
        file: &mut BlockFile<R>,
        at: u64,
        count: usize,
        lost: &mut LostRanges,
    ) -> io::Result<Bytes<'_>> {
        let end = at.saturating_add(count as u64);
        if end > self.len || count == 0 {
            return Ok(Bytes::End);
        }
        let mut index = self.piece_at(at);
        self.scratch.clear();
        loop {
            let Some(piece) = self.pieces.get(index).cloned() else {
                return Ok(Bytes::End);
            };
            if self.cached != Some(index) {
                self.cached = Some(index);
                if let Some(reason) = load(file, &piece, &mut self.cache)? {
                    lost.lose(
                        piece.file_at..(piece.file_at + piece.packed_len).min(file.len),
                        reason,
                    );
                }
            }
            let from = at.max(piece.start) - piece.start;
            let to = end.min(piece.start + piece.len) - piece.start;
            if to > self.cache.len() as u64 {
                // the intact beginning of a damaged block is read, the rest is not
                return Ok(Bytes::LostUntil(piece.start + piece.len));
            }
            let range = from as usize..to as usize;
            if self.scratch.is_empty() && range.len() == count {
                return Ok(Bytes::Found(self.cache.get(range).unwrap_or_default()));
            }
            self.scratch
                .extend_from_slice(self.cache.get(range).unwrap_or_default());
            if self.scratch.len() == count {
                return Ok(Bytes::Found(&self.scratch));
            }
            index += 1;
        }
    }

    fn piece_at(&self, at: u64) -> usize {
        if let Some(cached) = self.cached
            && let Some(piece) = self.pieces.get(cached)
            && (piece.start..piece.start + piece.len).contains(&at)
        {
            return cached;
        }
        self.pieces
            .partition_point(|piece| piece.start + piece.len <= at)
    }
}

/// Reads a piece; returns the error in it, if there is one.
fn load<R: Read + Seek>(
    file: &mut BlockFile<R>,
    piece: &Piece,
    into: &mut Vec<u8>,
) -> io::Result<Option<String>> {
    let packed = file.bytes(piece.file_at, piece.packed_len)?;
    into.clear();
    if piece.packing == Packing::None {
        *into = packed;
    } else {
        let mut decoder = ZlibDecoder::new(&packed[..]).take(piece.len);
        if let Err(error) = decoder.read_to_end(into) {
            let found = into.len();
            if piece.packing != Packing::Deflate {
                // columns of which some are missing
                into.clear();
            }
            return Ok(Some(say!("damaged zlib after {found} bytes: {error}")));
        }
    }
    if into.len() as u64 != piece.len {
        let found = into.len();
        if piece.packing != Packing::Deflate && piece.packing != Packing::None {
            into.clear();
        }
        return Ok(Some(say!(
            "expected {} bytes of data, found {found}",
            piece.len
        )));
    }
    if let Packing::Transposed(width) = piece.packing {
        *into = transposed(into, width as usize);
    }
    Ok(None)
}

/// Records from columns; bytes behind the last whole record stay where they are.
fn transposed(columns: &[u8], width: usize) -> Vec<u8> {
    if width < 2 {
        return columns.to_vec();
    }
    let rows = columns.len() / width;
    let (whole, rest) = columns.split_at(rows * width);
    let mut records = vec![0; whole.len()];
    for (column, bytes) in whole.chunks_exact(rows.max(1)).enumerate() {
        for (row, byte) in bytes.iter().enumerate() {
            if let Some(target) = records.get_mut(row * width + column) {
                *target = *byte;
            }
        }
    }
    records.extend_from_slice(rest);
    records
}

/// The length of a value of variable length, stored before it.
pub(super) fn value_length(bytes: &[u8]) -> Option<usize> {
    u32_at(bytes, 0).map(|len| len as usize)
}

/// An identifier of a record of one, two, four or eight bytes.
pub(super) fn record_id(bytes: &[u8]) -> Option<u64> {
    match bytes.len() {
        1 => bytes.first().map(|&byte| u64::from(byte)),
        2 => u16_at(bytes, 0).map(u64::from),
        4 => u32_at(bytes, 0).map(u64::from),
        8 => u64_at(bytes, 0),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_become_records() {
        assert_eq!(transposed(b"adbecfx", 3), b"abcdefx");
        assert_eq!(transposed(b"ab", 3), b"ab");
        assert_eq!(transposed(b"ab", 0), b"ab");
    }
}
