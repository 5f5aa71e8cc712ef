//! Compression of whole files: seen in their first bytes, whatever is packed.

use std::io::{self, BufRead, BufReader, Read};

use strum::Display;

/// How a file is compressed as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
pub(super) enum Packing {
    #[strum(serialize = "zstd")]
    Zstd,
    #[strum(serialize = "gzip")]
    Gzip,
    #[strum(serialize = "bzip2")]
    Bzip2,
    #[strum(serialize = "lz4")]
    Lz4,
}

impl Packing {
    /// The compression that the first bytes show; `None` if there is none.
    pub(super) fn of(first_bytes: &[u8]) -> Option<Self> {
        match first_bytes {
            [0x28, 0xb5, 0x2f, 0xfd, ..] => Some(Self::Zstd),
            // of gzip, deflate is the only method
            [0x1f, 0x8b, 8, ..] => Some(Self::Gzip),
            [b'B', b'Z', b'h', b'1'..=b'9', ..] => Some(Self::Bzip2),
            // a frame, and the older one of the program without a frame
            [0x04, 0x22, 0x4d, 0x18, ..] | [0x02, 0x21, 0x4c, 0x18, ..] => Some(Self::Lz4),
            _ => None,
        }
    }

    /// So many packed bytes are enough for the first unpacked ones: the largest block, and headers.
    pub(super) fn beginning_bytes(self) -> u64 {
        match self {
            Self::Zstd => 132 << 10,
            Self::Gzip => 132 << 10,
            Self::Bzip2 => 1 << 20,
            Self::Lz4 => (8 << 20) + (1 << 10),
        }
    }

    /// Unpacks; parts that were packed one by one and joined follow each other.
    pub(super) fn unpack<'r>(self, packed: impl Read + 'r) -> io::Result<Box<dyn Read + 'r>> {
        let packed = BufReader::with_capacity(1 << 16, packed);
        Ok(match self {
            Self::Zstd => Box::new(zstd::stream::read::Decoder::with_buffer(packed)?),
            Self::Gzip => Box::new(flate2::bufread::MultiGzDecoder::new(packed)),
            Self::Bzip2 => Box::new(bzip2::bufread::MultiBzDecoder::new(packed)),
            Self::Lz4 => Box::new(Lz4Frames(lz4_flex::frame::FrameDecoder::new(packed))),
        })
    }
}

/// The decoder pauses at the end of every frame.
struct Lz4Frames<R: Read>(lz4_flex::frame::FrameDecoder<R>);

impl<R: BufRead> Read for Lz4Frames<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let count = self.0.read(buffer)?;
            if count > 0 || buffer.is_empty() || self.0.get_mut().fill_buf()?.is_empty() {
                return Ok(count);
            }
        }
    }
}
