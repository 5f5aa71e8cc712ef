//! Compression of whole files: seen in their first bytes, whatever is packed.

use std::io::{self, BufRead, BufReader, Read};

use bzip2::bufread::BzDecoder;
use flate2::bufread::GzDecoder;
use lz4_flex::frame::FrameDecoder;
use strum::Display;
use zstd::stream::read::Decoder as ZstdDecoder;

/// Compression of a file as a whole.
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

    /// Returns the number of packed bytes that are enough for the first unpacked ones: the largest block, and headers.
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
        Ok(Box::new(Members {
            packing: self,
            member: Some(Member::new(self, packed)?),
        }))
    }
}

/// The parts of a file, each packed by itself. Zeros between and behind them, to which tapes and disks fill up blocks, are
/// no part.
struct Members<R: BufRead> {
    packing: Packing,
    /// `None` once a part cannot begin.
    member: Option<Member<R>>,
}

enum Member<R: BufRead> {
    Zstd(ZstdDecoder<'static, R>),
    Gzip(GzDecoder<R>),
    Bzip2(BzDecoder<R>),
    Lz4(FrameDecoder<R>),
}

impl<R: BufRead> Member<R> {
    fn new(packing: Packing, packed: R) -> io::Result<Self> {
        Ok(match packing {
            Packing::Zstd => Self::Zstd(ZstdDecoder::with_buffer(packed)?.single_frame()),
            Packing::Gzip => Self::Gzip(GzDecoder::new(packed)),
            Packing::Bzip2 => Self::Bzip2(BzDecoder::new(packed)),
            Packing::Lz4 => Self::Lz4(FrameDecoder::new(packed)),
        })
    }

    fn into_rest(self) -> R {
        match self {
            Self::Zstd(decoder) => decoder.finish(),
            Self::Gzip(decoder) => decoder.into_inner(),
            Self::Bzip2(decoder) => decoder.into_inner(),
            Self::Lz4(decoder) => decoder.into_inner(),
        }
    }
}

impl<R: BufRead> Read for Member<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Zstd(decoder) => decoder.read(buffer),
            Self::Gzip(decoder) => decoder.read(buffer),
            Self::Bzip2(decoder) => decoder.read(buffer),
            Self::Lz4(decoder) => decoder.read(buffer),
        }
    }
}

impl<R: BufRead> Read for Members<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while let Some(member) = &mut self.member {
            let count = member.read(buffer)?;
            if count > 0 || buffer.is_empty() {
                return Ok(count);
            }
            let Some(mut rest) = self.member.take().map(Member::into_rest) else {
                break;
            };
            if pass_over_zeros(&mut rest)? {
                self.member = Some(Member::new(self.packing, rest)?);
            }
        }
        Ok(0)
    }
}

/// Returns whether anything follows.
fn pass_over_zeros(packed: &mut impl BufRead) -> io::Result<bool> {
    loop {
        let bytes = packed.fill_buf()?;
        let all = bytes.len();
        let zeros = bytes.iter().take_while(|byte| **byte == 0).count();
        packed.consume(zeros);
        if zeros < all || all == 0 {
            return Ok(all > 0);
        }
    }
}
