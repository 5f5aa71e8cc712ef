//! LZ4 frames, unpacked block by block straight to where their content belongs.
//!
//! The checksums of a frame (xxHash of its header, blocks and content) are passed over: this is for
//! chunks whose own CRC covers the whole content. A frame that is unusual or damaged is left to the
//! general decoder, which also tells what is wrong with it.

use lz4_flex::block::{decompress_into, decompress_into_with_dict};

const MAGIC: [u8; 4] = 0x184D_2204_u32.to_le_bytes();
const VERSION_MASK: u8 = 0b1100_0010;
const VERSION: u8 = 0b0100_0000;
const INDEPENDENT_BLOCKS: u8 = 0b0010_0000;
const BLOCK_CHECKSUMS: u8 = 0b0001_0000;
const CONTENT_SIZE: u8 = 0b0000_1000;
const CONTENT_CHECKSUM: u8 = 0b0000_0100;
const DICTIONARY: u8 = 0b0000_0001;
const CHECKSUM_BYTES: usize = 4;
/// How far back a match may lie.
const WINDOW_BYTES: usize = 64 << 10;
const NOT_COMPRESSED: u32 = 1 << 31;

/// One frame that fills a whole chunk.
#[derive(Clone, Copy)]
pub(crate) struct Frame<'a> {
    flags: u8,
    block_limit_bytes: usize,
    blocks: &'a [u8],
}

enum Block<'a> {
    Plain(&'a [u8]),
    Packed(&'a [u8]),
}

impl<'a> Frame<'a> {
    /// `None` for anything but one ordinary frame.
    pub(crate) fn parse(data: &'a [u8]) -> Option<Self> {
        let rest = data.strip_prefix(&MAGIC)?;
        let (&[flags, sizes], rest) = rest.split_first_chunk()?;
        if flags & VERSION_MASK != VERSION || flags & DICTIONARY != 0 || sizes & 0b1000_1111 != 0 {
            return None;
        }
        let content_size_bytes = if flags & CONTENT_SIZE != 0 { 8 } else { 0 };
        let header_checksum_bytes = 1;
        Some(Self {
            flags,
            block_limit_bytes: match sizes >> 4 {
                4 => 64 << 10,
                5 => 256 << 10,
                6 => 1 << 20,
                7 => 4 << 20,
                _ => return None,
            },
            blocks: rest.get(content_size_bytes + header_checksum_bytes..)?,
        })
    }

    /// No more than this can come out of it; `None` if its blocks do not follow each other.
    pub(crate) fn most_bytes(self) -> Option<u64> {
        let mut most = 0_u64;
        self.each_block(|block| {
            most += match block {
                Block::Plain(bytes) => bytes.len(),
                Block::Packed(_) => self.block_limit_bytes,
            } as u64;
            Some(())
        })?;
        Some(most)
    }

    /// Unpacks it into `target`; `None` unless it fills that exactly.
    pub(crate) fn fill(self, target: &mut [u8]) -> Option<()> {
        let mut filled = 0;
        self.each_block(|block| {
            let (before, room) = target.split_at_mut_checked(filled)?;
            filled += match block {
                Block::Plain(bytes) => {
                    room.get_mut(..bytes.len())?.copy_from_slice(bytes);
                    bytes.len()
                }
                Block::Packed(bytes) => {
                    let count = room.len().min(self.block_limit_bytes);
                    let room = room.get_mut(..count)?;
                    if self.flags & INDEPENDENT_BLOCKS != 0 || before.is_empty() {
                        decompress_into(bytes, room).ok()?
                    } else {
                        let window = before.len().saturating_sub(WINDOW_BYTES);
                        decompress_into_with_dict(bytes, room, before.get(window..)?).ok()?
                    }
                }
            };
            Some(())
        })?;
        (filled == target.len()).then_some(())
    }

    /// `None` if `take` says so, if a block does not fit, or if the frame does not end with the data.
    fn each_block(self, mut take: impl FnMut(Block<'a>) -> Option<()>) -> Option<()> {
        let mut rest = self.blocks;
        loop {
            let (head, after) = rest.split_first_chunk()?;
            let head = u32::from_le_bytes(*head);
            if head == 0 {
                let has_checksum = self.flags & CONTENT_CHECKSUM != 0;
                let expected = if has_checksum { CHECKSUM_BYTES } else { 0 };
                return (after.len() == expected).then_some(());
            }
            let count = (head & !NOT_COMPRESSED) as usize;
            if count > self.block_limit_bytes {
                return None;
            }
            let (bytes, after) = after.split_at_checked(count)?;
            rest = match self.flags & BLOCK_CHECKSUMS {
                0 => after,
                _ => after.get(CHECKSUM_BYTES..)?,
            };
            take(match head & NOT_COMPRESSED {
                0 => Block::Packed(bytes),
                _ => Block::Plain(bytes),
            })?;
        }
    }
}
