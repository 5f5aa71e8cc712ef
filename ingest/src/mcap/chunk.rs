//! The content of a chunk: decompressed within limits, and checked against its checksum.

use std::io::Read;

use zstd::{bulk, stream, zstd_safe};

use super::record::ChunkRecord;

/// Writers make chunks of about a megabyte; more than this is taken for a damaged length.
const CHUNK_LIMIT_BYTES: u64 = 1 << 30;
/// LZ4 spends at least one byte on 255.
const LZ4_MAX_RATIO: u64 = 255;
/// What a buffer grows by where the size is not known beforehand.
const GROWTH_BYTES: usize = 1 << 20;

/// Decompresses chunk after chunk into one buffer.
#[derive(Default)]
pub(super) struct Decompressor {
    buffer: Vec<u8>,
    zstd: Option<bulk::Decompressor<'static>>,
}

impl Decompressor {
    /// The whole content of a chunk, or why it cannot be had.
    pub(super) fn content<'c>(&'c mut self, chunk: &ChunkRecord<'c>) -> Result<&'c [u8], String> {
        check_sizes(chunk)?;
        let content = match chunk.compression {
            "" => chunk.data,
            "lz4" => self.lz4(chunk)?,
            "zstd" => self.zstd(chunk)?,
            other => {
                return Err(format!(
                    "expected no compression, lz4 or zstd, found {other:?}"
                ));
            }
        };
        check_crc(chunk.crc, content)?;
        Ok(content)
    }

    /// As much of the content as a cut chunk still yields. No checksum can vouch for it.
    pub(super) fn partial_content<'c>(&'c mut self, chunk: &ChunkRecord<'c>) -> &'c [u8] {
        let limit = chunk.uncompressed_bytes.min(CHUNK_LIMIT_BYTES);
        let filled = match chunk.compression {
            "" => return chunk.data,
            "lz4" => fill(
                &mut self.buffer,
                lz4_flex::frame::FrameDecoder::new(chunk.data),
                limit,
            ),
            "zstd" => match stream::read::Decoder::with_buffer(chunk.data) {
                Ok(decoder) => fill(&mut self.buffer, decoder, limit),
                Err(_) => 0,
            },
            _ => 0,
        };
        self.buffer.get(..filled).unwrap_or_default()
    }

    fn lz4(&mut self, chunk: &ChunkRecord<'_>) -> Result<&[u8], String> {
        let possible = (chunk.data.len() as u64).saturating_mul(LZ4_MAX_RATIO);
        if chunk.uncompressed_bytes > possible {
            let (declared, given) = (chunk.uncompressed_bytes, chunk.data.len());
            return Err(format!(
                "{declared} bytes cannot come out of {given} bytes of lz4"
            ));
        }
        let decoder = lz4_flex::frame::FrameDecoder::new(chunk.data);
        self.stream(decoder, chunk.uncompressed_bytes)
    }

    fn zstd(&mut self, chunk: &ChunkRecord<'_>) -> Result<&[u8], String> {
        let declared = chunk.uncompressed_bytes;
        let in_frame = zstd_safe::get_frame_content_size(chunk.data).ok().flatten();
        if in_frame == Some(declared) {
            return self.zstd_at_once(chunk);
        }
        // The frame does not confirm the size, so the buffer grows only with real content.
        let decoder = stream::read::Decoder::with_buffer(chunk.data)
            .map_err(|error| format!("zstd: {error}"))?;
        self.stream(decoder, declared)
    }

    fn zstd_at_once(&mut self, chunk: &ChunkRecord<'_>) -> Result<&[u8], String> {
        let wanted = grow_to(&mut self.buffer, chunk.uncompressed_bytes)?;
        let decompressor = match &mut self.zstd {
            Some(decompressor) => decompressor,
            empty => {
                empty.insert(bulk::Decompressor::new().map_err(|error| format!("zstd: {error}"))?)
            }
        };
        let target = self.buffer.get_mut(..wanted).unwrap_or_default();
        let filled = decompressor
            .decompress_to_buffer(chunk.data, target)
            .map_err(|error| format!("zstd: {error}"))?;
        check_filled(filled as u64, chunk.uncompressed_bytes)?;
        Ok(self.buffer.get(..filled).unwrap_or_default())
    }

    fn stream(&mut self, mut decoder: impl Read, declared: u64) -> Result<&[u8], String> {
        let mut filled = 0;
        loop {
            // One byte more than declared, so that too long a content shows.
            let room = declared.saturating_add(1).saturating_sub(filled as u64);
            if room == 0 {
                return Err(format!("expected {declared} bytes of content, found more"));
            }
            let count = room.min(GROWTH_BYTES as u64);
            let end = grow_to(&mut self.buffer, filled as u64 + count)?;
            let target = self.buffer.get_mut(filled..end).unwrap_or_default();
            match decoder
                .read(target)
                .map_err(|error| format!("decompression: {error}"))?
            {
                0 => break,
                more => filled += more,
            }
        }
        check_filled(filled as u64, declared)?;
        Ok(self.buffer.get(..filled).unwrap_or_default())
    }
}

fn check_sizes(chunk: &ChunkRecord<'_>) -> Result<(), String> {
    let (declared, found) = (chunk.compressed_bytes, chunk.data.len() as u64);
    if declared != found {
        return Err(format!(
            "expected {declared} bytes of compressed data, found {found}"
        ));
    }
    let uncompressed = chunk.uncompressed_bytes;
    if uncompressed > CHUNK_LIMIT_BYTES {
        return Err(format!(
            "{uncompressed} bytes of content exceed {CHUNK_LIMIT_BYTES}"
        ));
    }
    if chunk.compression.is_empty() && uncompressed != found {
        return Err(format!(
            "expected {uncompressed} bytes of content, found {found}"
        ));
    }
    Ok(())
}

fn check_crc(expected: u32, content: &[u8]) -> Result<(), String> {
    if expected == 0 {
        return Ok(());
    }
    let found = crc32fast::hash(content);
    if found == expected {
        return Ok(());
    }
    Err(format!("CRC: expected {expected:08x}, found {found:08x}"))
}

fn check_filled(filled: u64, declared: u64) -> Result<(), String> {
    if filled == declared {
        return Ok(());
    }
    Err(format!(
        "expected {declared} bytes of content, found {filled}"
    ))
}

/// Makes the buffer hold at least `count` bytes and gives back `count`.
fn grow_to(buffer: &mut Vec<u8>, count: u64) -> Result<usize, String> {
    let no_memory = || format!("{count} bytes of content do not fit into memory");
    let wanted = usize::try_from(count).map_err(|_| no_memory())?;
    if buffer.len() < wanted {
        buffer
            .try_reserve(wanted - buffer.len())
            .map_err(|_| no_memory())?;
        buffer.resize(wanted, 0);
    }
    Ok(wanted)
}

/// Reads until the decoder ends or fails, and tells how much came.
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
