//! A chunk before decompression.

/// Compression of a chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Compression<'a> {
    None,
    Lz4,
    Zstd,
    Bz2,
    Other(&'a str),
}

/// A chunk before decompression.
pub(crate) struct PackedChunk<'a> {
    pub(crate) compression: Compression<'a>,
    pub(crate) uncompressed_bytes: u64,
    /// `None` if the writer computed none.
    pub(crate) crc: Option<u32>,
    /// Size by the header; `data` is shorter if the file ends earlier.
    pub(crate) declared_bytes: u64,
    pub(crate) data: &'a [u8],
}

impl PackedChunk<'_> {
    /// Whether a checksum of the chunk or of its compression detects a flipped bit.
    pub(crate) fn has_checksum(&self) -> bool {
        let flags = self.data.get(4).copied().unwrap_or(0);
        self.crc.is_some()
            || match self.compression {
                Compression::Bz2 => true,
                // Checksum of the content, or of each block.
                Compression::Lz4 => flags & 0x14 != 0,
                Compression::Zstd => flags & 0x04 != 0,
                Compression::None | Compression::Other(_) => false,
            }
    }
}
