//! Decompresses chunks within limits and verifies their checksums.

use std::io::Read;

use tipwatch_language::{say, word};
use zstd::{bulk, stream, zstd_safe};

use super::{
    lz4::{self, End, FrameChecksums},
    packed_chunk::{Compression, PackedChunk},
};

/// Writers make chunks of about a megabyte; anything larger is taken as a damaged length.
const CHUNK_LIMIT_BYTES: u64 = 1 << 30;
/// LZ4 encodes at most 255 bytes per byte.
const LZ4_MAX_RATIO: u64 = 255;
/// Largest buffer allocated on the word of one header. Beyond it a second field must confirm the
/// size, or decompressed content must fill the buffer first.
const BELIEVED_BYTES: u64 = 16 << 20;
/// Step by which a buffer grows if the size is unknown.
const GROWTH_BYTES: usize = 1 << 20;

/// Location of the decompressed content of a chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Content {
    /// The data itself, which is not compressed.
    AsPacked,
    /// The first bytes of the buffer.
    Buffer(usize),
}

/// Decompresses chunk after chunk.
#[derive(Default)]
pub(super) struct Decompressor {
    lz4: lz4::Decoder,
    zstd: Option<bulk::Decompressor<'static>>,
}

impl Decompressor {
    /// Returns the whole content of a chunk, or the reason why it is not available.
    pub(super) fn content(
        &mut self,
        chunk: &PackedChunk<'_>,
        buffer: &mut Vec<u8>,
    ) -> Result<Content, String> {
        check_sizes(chunk)?;
        let content = match chunk.compression {
            Compression::None => Content::AsPacked,
            Compression::Lz4 => Content::Buffer(self.lz4(chunk, buffer)?),
            Compression::Zstd => Content::Buffer(self.zstd(chunk, buffer)?),
            Compression::Bz2 => {
                let decoder = bzip2::bufread::BzDecoder::new(chunk.data);
                Content::Buffer(stream(decoder, chunk.uncompressed_bytes, buffer)?)
            }
            Compression::Other(name) => {
                return Err(say!(
                    "expected no compression, lz4, zstd or bz2, found {name:?}"
                ));
            }
        };
        if let Some(expected) = chunk.crc {
            let bytes = match content {
                Content::AsPacked => chunk.data,
                Content::Buffer(filled) => buffer.get(..filled).unwrap_or_default(),
            };
            check_crc(expected, bytes)?;
        }
        Ok(content)
    }

    /// The content that a truncated chunk still yields. No checksum can confirm it.
    pub(super) fn partial_content(chunk: &PackedChunk<'_>, buffer: &mut Vec<u8>) -> Content {
        let limit = chunk.uncompressed_bytes.min(CHUNK_LIMIT_BYTES);
        Content::Buffer(match chunk.compression {
            Compression::None => return Content::AsPacked,
            Compression::Lz4 => partial_lz4(chunk.data, limit, buffer),
            Compression::Zstd => match stream::read::Decoder::with_buffer(chunk.data) {
                Ok(decoder) => fill(buffer, decoder, limit),
                Err(_) => 0,
            },
            Compression::Bz2 => fill(buffer, bzip2::bufread::BzDecoder::new(chunk.data), limit),
            Compression::Other(_) => 0,
        })
    }

    fn lz4(&mut self, chunk: &PackedChunk<'_>, buffer: &mut Vec<u8>) -> Result<usize, String> {
        let (declared, given) = (chunk.uncompressed_bytes, chunk.data.len());
        if declared > (given as u64).saturating_mul(LZ4_MAX_RATIO) {
            return Err(say!(
                "{given} bytes of lz4 cannot expand to {declared} bytes"
            ));
        }
        let checksums = match chunk.crc {
            Some(_) => FrameChecksums::Skipped,
            None => FrameChecksums::Verified,
        };
        let mut room = declared.min(BELIEVED_BYTES);
        loop {
            let wanted = make_room(buffer, room)?;
            let target = buffer.get_mut(..wanted).unwrap_or_default();
            match self.lz4.unpack(chunk.data, target, checksums) {
                (filled, End::Complete) => {
                    check_filled(filled as u64, declared)?;
                    return Ok(filled);
                }
                (_, End::Full) if room < declared => room = more_room(room, declared),
                (_, End::Full) => return Err(too_long(declared)),
                (_, End::Cut) => return Err(word!("lz4: the data ends within a frame").to_owned()),
                (_, End::Damaged(reason)) => return Err(reason),
            }
        }
    }

    fn zstd(&mut self, chunk: &PackedChunk<'_>, buffer: &mut Vec<u8>) -> Result<usize, String> {
        let declared = chunk.uncompressed_bytes;
        let in_frame = zstd_safe::get_frame_content_size(chunk.data).ok().flatten();
        // Many writers stream, and then the frame does not state its size.
        if in_frame == Some(declared) || in_frame.is_none() && declared <= BELIEVED_BYTES {
            return self.zstd_at_once(chunk, buffer);
        }
        // Nothing confirms the size, so the buffer grows only as content arrives.
        let decoder = stream::read::Decoder::with_buffer(chunk.data)
            .map_err(|error| format!("zstd: {error}"))?;
        stream(decoder, declared, buffer)
    }

    fn zstd_at_once(
        &mut self,
        chunk: &PackedChunk<'_>,
        buffer: &mut Vec<u8>,
    ) -> Result<usize, String> {
        let wanted = make_room(buffer, chunk.uncompressed_bytes)?;
        let decompressor = match &mut self.zstd {
            Some(decompressor) => decompressor,
            empty => {
                empty.insert(bulk::Decompressor::new().map_err(|error| format!("zstd: {error}"))?)
            }
        };
        let target = buffer.get_mut(..wanted).unwrap_or_default();
        let filled = decompressor
            .decompress_to_buffer(chunk.data, target)
            .map_err(|error| format!("zstd: {error}"))?;
        check_filled(filled as u64, chunk.uncompressed_bytes)?;
        Ok(filled)
    }
}

/// Decompresses up to the end or the first damage.
fn partial_lz4(data: &[u8], limit: u64, buffer: &mut Vec<u8>) -> usize {
    let possible = (data.len() as u64).saturating_mul(LZ4_MAX_RATIO).min(limit);
    let mut decoder = lz4::Decoder::default();
    let mut room = possible.min(BELIEVED_BYTES);
    let mut filled = 0;
    while let Ok(wanted) = grow_to(buffer, room) {
        let target = buffer.get_mut(..wanted).unwrap_or_default();
        let (came, end) = decoder.unpack_up_to_damage(data, target);
        filled = came;
        if end != End::Full || room == possible {
            break;
        }
        room = more_room(room, possible);
    }
    filled
}

/// The next buffer size, after content has filled the last one.
fn more_room(room: u64, most: u64) -> u64 {
    room.saturating_mul(4).min(most)
}

fn stream(mut decoder: impl Read, declared: u64, buffer: &mut Vec<u8>) -> Result<usize, String> {
    let mut filled = 0;
    loop {
        // One byte more than declared, to detect content that is too long.
        let room = declared.saturating_add(1).saturating_sub(filled as u64);
        if room == 0 {
            return Err(too_long(declared));
        }
        let count = room.min(GROWTH_BYTES as u64);
        let end = grow_to(buffer, filled as u64 + count)?;
        let target = buffer.get_mut(filled..end).unwrap_or_default();
        match decoder
            .read(target)
            .map_err(|error| say!("decompression: {error}"))?
        {
            0 => break,
            more => filled += more,
        }
    }
    check_filled(filled as u64, declared)?;
    Ok(filled)
}

fn too_long(declared: u64) -> String {
    say!("expected {declared} bytes of content, found more")
}

fn check_sizes(chunk: &PackedChunk<'_>) -> Result<(), String> {
    let (declared, found) = (chunk.declared_bytes, chunk.data.len() as u64);
    if declared != found {
        return Err(say!(
            "expected {declared} bytes of compressed data, found {found}"
        ));
    }
    let uncompressed = chunk.uncompressed_bytes;
    if uncompressed > CHUNK_LIMIT_BYTES {
        return Err(say!(
            "{uncompressed} bytes of content exceed {CHUNK_LIMIT_BYTES}"
        ));
    }
    if chunk.compression == Compression::None && uncompressed != found {
        return Err(say!(
            "expected {uncompressed} bytes of content, found {found}"
        ));
    }
    Ok(())
}

fn check_crc(expected: u32, content: &[u8]) -> Result<(), String> {
    let found = crc32fast::hash(content);
    if found == expected {
        return Ok(());
    }
    Err(say!("CRC: expected {expected:08x}, found {found:08x}"))
}

fn check_filled(filled: u64, declared: u64) -> Result<(), String> {
    if filled == declared {
        return Ok(());
    }
    Err(say!("expected {declared} bytes of content, found {filled}"))
}

/// Like [`grow_to`], but what is in the buffer may get lost: it need not be copied, nor be there twice.
fn make_room(buffer: &mut Vec<u8>, count: u64) -> Result<usize, String> {
    let wanted = usize::try_from(count).unwrap_or(usize::MAX);
    if buffer.capacity() < wanted {
        *buffer = Vec::new();
        // Chunks of one writer differ by a message or two.
        let slack = (wanted / 8).min(GROWTH_BYTES);
        // Without the slack it may fit.
        let _ = buffer.try_reserve_exact(wanted.saturating_add(slack));
    }
    grow_to(buffer, count)
}

/// Grows the buffer to at least `count` bytes and returns `count`.
fn grow_to(buffer: &mut Vec<u8>, count: u64) -> Result<usize, String> {
    let no_memory = || say!("{count} bytes of content do not fit into memory");
    let wanted = usize::try_from(count).map_err(|_| no_memory())?;
    if buffer.len() < wanted {
        buffer
            .try_reserve(wanted - buffer.len())
            .map_err(|_| no_memory())?;
        buffer.resize(wanted, 0);
    }
    Ok(wanted)
}

/// Reads until the decoder ends or fails, and returns the number of bytes.
fn fill(buffer: &mut Vec<u8>, mut decoder: impl Read, limit: u64) -> usize {
    let mut filled = 0;
    while (filled as u64) < limit {
        let count = (limit - filled as u64).min(GROWTH_BYTES as u64);
        let Ok(end) = grow_to(buffer, filled as u64 + count) else {
            break;
        };
        let target = buffer.get_mut(filled..end).unwrap_or_default();
        match decoder.read(target) {
            Ok(0) | Err(_) => break,
            Ok(more) => filled += more,
        }
    }
    filled
}
