//! Decompresses LZ4 frames with the reference library, directly into the target buffer.
//!
//! It is called directly because only the raw interface can skip the frame checksums (xxHash) where
//! the chunk has its own checksum over the same bytes, and can promise that the output stays in
//! place, so that the library keeps no copy. This is three times as fast as decoders behind
//! [`std::io::Read`], and decompression is most of the work of reading a log.

// The decoder is a C library.
#![allow(unsafe_code)]

use std::ffi::CStr;

use lz4_sys::{
    LZ4F_createDecompressionContext, LZ4F_decompress, LZ4F_freeDecompressionContext,
    LZ4F_getErrorName, LZ4F_isError, LZ4FDecompressOptions, LZ4FDecompressionContext,
};

/// `LZ4F_VERSION` of its header.
const API_VERSION: u32 = 100;

/// Verification of the checksums within a frame of LZ4.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FrameChecksums {
    Verified,
    /// The chunk's checksum covers the content.
    Skipped,
}

/// Outcome of a decompression.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum End {
    /// All data was decompressed.
    Complete,
    /// The target is full, but data is left.
    Full,
    /// The data ends within a frame.
    Cut,
    Damaged(String),
}

/// A reusable decoder.
#[derive(Default)]
pub(crate) struct Decoder {
    /// `None` before the first frame, and after an error, which leaves the context undefined.
    context: Option<Context>,
}

impl Decoder {
    /// Decompresses consecutive frames into `target`.
    pub(crate) fn unpack(
        &mut self,
        data: &[u8],
        target: &mut [u8],
        checksums: FrameChecksums,
    ) -> (usize, End) {
        self.unpack_in_steps(data, target, checksums, usize::MAX)
    }

    /// Like [`unpack`](Self::unpack), but keeps the content before damage, except for the last few
    /// kilobytes.
    pub(crate) fn unpack_up_to_damage(&mut self, data: &[u8], target: &mut [u8]) -> (usize, End) {
        const STEP_BYTES: usize = 4 << 10;
        self.unpack_in_steps(data, target, FrameChecksums::Verified, STEP_BYTES)
    }

    /// Returns the number of bytes and how decompression ended. The library discards the output of
    /// a failed step, so small steps lose little.
    fn unpack_in_steps(
        &mut self,
        data: &[u8],
        target: &mut [u8],
        checksums: FrameChecksums,
        step_bytes: usize,
    ) -> (usize, End) {
        let context = match &mut self.context {
            Some(context) => context,
            empty => match Context::new() {
                Ok(context) => empty.insert(context),
                Err(reason) => return (0, End::Damaged(reason)),
            },
        };
        let (filled, end) = context.frames(data, target, checksums, step_bytes);
        if end != End::Complete {
            self.context = None;
        }
        (filled, end)
    }
}

/// Owns a context of the library; never null.
struct Context(LZ4FDecompressionContext);

impl Context {
    fn new() -> Result<Self, String> {
        let mut context = LZ4FDecompressionContext(std::ptr::null_mut());
        // SAFETY: the call writes only the pointer.
        let code = unsafe { LZ4F_createDecompressionContext(&mut context, API_VERSION) };
        match error(code) {
            None if !context.0.is_null() => Ok(Self(context)),
            reason => Err(reason.unwrap_or_else(|| "lz4: cannot create a decoder".to_owned())),
        }
    }

    fn frames(
        &mut self,
        data: &[u8],
        target: &mut [u8],
        checksums: FrameChecksums,
        step_bytes: usize,
    ) -> (usize, End) {
        let skips = u32::from(checksums == FrameChecksums::Skipped);
        let options = LZ4FDecompressOptions {
            stable_dst: 1,
            // The first reserved field is `skipChecksums`.
            reserved: [skips, 0, 0],
        };
        let (target_start, target_bytes) = (target.as_mut_ptr(), target.len());
        let (mut read, mut filled, mut is_between_frames) = (0, 0, true);
        loop {
            let rest = data.get(read..).unwrap_or_default();
            if rest.is_empty() && is_between_frames {
                return (filled, End::Complete);
            }
            let (mut taken, mut written) = (rest.len().min(step_bytes), target_bytes - filled);
            // SAFETY: both ranges lie within the borrowed slices: `filled` never exceeds the
            // target, because the library writes and reports no more than the space it is given. As
            // `stable_dst` requires, the output stays in place until the last call for this target.
            // The next frame starts afresh in any target.
            let code = unsafe {
                LZ4F_decompress(
                    self.0,
                    target_start.add(filled),
                    &mut written,
                    rest.as_ptr(),
                    &mut taken,
                    &options,
                )
            };
            if let Some(reason) = error(code) {
                return (filled, End::Damaged(reason));
            }
            filled += written;
            read += taken;
            is_between_frames = code == 0;
            if taken == 0 && written == 0 {
                let end = match rest.is_empty() {
                    true => End::Cut,
                    false => End::Full,
                };
                return (filled, end);
            }
        }
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // SAFETY: the library created the context, and it is not used again.
        unsafe { LZ4F_freeDecompressionContext(self.0) };
    }
}

fn error(code: usize) -> Option<String> {
    // SAFETY: the call only inspects the number; the name is a constant of the library.
    let name = unsafe {
        if LZ4F_isError(code) == 0 {
            return None;
        }
        CStr::from_ptr(LZ4F_getErrorName(code))
    };
    Some(format!("lz4: {}", name.to_string_lossy()))
}
