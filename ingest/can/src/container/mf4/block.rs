//! Blocks: a header with a type, links to other blocks, and data.

use std::io::{self, Read, Seek, SeekFrom};

use tipwatch_language::say;

use crate::{
    bits::{array_at, u64_at},
    container::{lost::LostRanges, written::Written},
};

pub(super) const HEADER_BYTES: u64 = 24;
/// Blocks of descriptions; those of measured data are not read as a whole.
const MOST_BYTES: u64 = 1 << 20;

/// The header of a block.
#[derive(Debug, Clone, Copy)]
pub(super) struct Header {
    pub(super) at: u64,
    pub(super) kind: [u8; 2],
    pub(super) len: u64,
    pub(super) link_count: u64,
}

/// A block as a whole.
#[derive(Debug)]
pub(super) struct Block {
    pub(super) links: Vec<u64>,
    pub(super) data: Vec<u8>,
}

impl Block {
    /// A link; zero if there is none.
    pub(super) fn link(&self, index: usize) -> u64 {
        self.links.get(index).copied().unwrap_or(0)
    }
}

/// A file, of which any part may be damaged. Reasons are sentences for the report of losses.
#[derive(Debug)]
pub(super) struct BlockFile<R> {
    source: R,
    pub(super) len: u64,
}

impl<R: Read + Seek> BlockFile<R> {
    pub(super) fn new(mut source: R, lost: &mut LostRanges) -> io::Result<Self> {
        let written = Written::of(&mut source)?;
        if let Some(note) = written.note() {
            lost.note(note);
        }
        let len = written.bytes;
        Ok(Self { source, len })
    }

    /// Bytes of the file, fewer at its end.
    pub(super) fn bytes(&mut self, at: u64, count: u64) -> io::Result<Vec<u8>> {
        self.source.seek(SeekFrom::Start(at))?;
        let mut bytes = Vec::new();
        let count = count.min(self.len.saturating_sub(at));
        (&mut self.source).take(count).read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    pub(super) fn header(&mut self, at: u64) -> io::Result<Result<Header, String>> {
        let bytes = match at < self.len {
            true => self.bytes(at, HEADER_BYTES)?,
            false => Vec::new(),
        };
        Ok(header(&bytes, at, self.len))
    }

    /// A block of the given kind.
    pub(super) fn block(&mut self, at: u64, kind: [u8; 2]) -> io::Result<Result<Block, String>> {
        let header = match self.header(at)? {
            Ok(header) if header.kind == kind => header,
            Ok(header) => {
                let (wanted, found) = (kind.escape_ascii(), header.kind.escape_ascii());
                return Ok(Err(say!(
                    "expected a block ##{wanted} at byte {at}, found ##{found}"
                )));
            }
            Err(reason) => return Ok(Err(reason)),
        };
        if header.len > MOST_BYTES {
            return Ok(Err(say!("a block of {} bytes at byte {at}", header.len)));
        }
        let body = self.bytes(at + HEADER_BYTES, header.len - HEADER_BYTES)?;
        let link_bytes = header.link_count as usize * 8;
        let (Some(links), Some(data)) = (body.get(..link_bytes), body.get(link_bytes..)) else {
            return Ok(Err(say!("the block at byte {at} is cut off")));
        };
        let links = (0..links.len() / 8).filter_map(|index| u64_at(links, index * 8));
        Ok(Ok(Block {
            links: links.collect(),
            data: data.to_vec(),
        }))
    }

    /// The text of a block of text, empty if there is none.
    pub(super) fn text(&mut self, at: u64) -> io::Result<Result<String, String>> {
        if at == 0 {
            return Ok(Ok(String::new()));
        }
        Ok(self.block(at, *b"TX")?.map(|block| {
            let end = block.data.iter().position(|&byte| byte == 0);
            let text = block.data.get(..end.unwrap_or(block.data.len()));
            String::from_utf8_lossy(text.unwrap_or_default()).into_owned()
        }))
    }
}

fn header(bytes: &[u8], at: u64, file_len: u64) -> Result<Header, String> {
    let parts = || {
        let magic: [u8; 4] = array_at(bytes, 0)?;
        let (len, link_count) = (u64_at(bytes, 8)?, u64_at(bytes, 16)?);
        Some((magic, len, link_count))
    };
    let Some(([b'#', b'#', first, second], len, link_count)) = parts() else {
        return Err(say!(
            "expected a block at byte {at} of {file_len}, found none"
        ));
    };
    // a file that was cut off has less than the block states; sums of places in the file stay small
    let len = len.min(file_len);
    let is_possible = len >= HEADER_BYTES
        && link_count
            .checked_mul(8)
            .is_some_and(|links| links <= len - HEADER_BYTES);
    if !is_possible {
        return Err(say!(
            "the block at byte {at} has {len} bytes and {link_count} links"
        ));
    }
    Ok(Header {
        at,
        kind: [first, second],
        len,
        link_count,
    })
}
