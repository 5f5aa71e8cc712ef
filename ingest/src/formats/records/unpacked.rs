//! One chunk and its content after unpacking.

use std::{
    ops::Range,
    panic::{AssertUnwindSafe, catch_unwind},
};

use tipwatch_language::word;

use super::{
    decompress::{Content, Decompressor},
    grammar::Grammar,
    intake::{Intake, TakenIn},
};
use crate::{file::FileBytes, message::Error};

/// Buffers that grew beyond this are not kept.
const KEPT_BUFFER_BYTES: usize = 32 << 20;

/// The bytes of one chunk; reused for other chunks.
#[derive(Default)]
pub(super) struct Buffers {
    /// The record as in the file.
    packed: Vec<u8>,
    /// The decompressed content.
    content: Vec<u8>,
}

/// One chunk and its content; reused for other chunks.
#[derive(Default)]
pub(super) struct Unpacked {
    buffers: Buffers,
    /// The range of the data in the packed record.
    data: Range<usize>,
    content: Option<Content>,
    /// Whether a checksum covers the content.
    pub(super) has_checksum: bool,
    /// Reason why the content is not available.
    pub(super) failure: Option<String>,
    /// Its decoded messages if `is_taken_in`, else buffers to decode into.
    intake: Option<TakenIn>,
    is_taken_in: bool,
    /// Whether the content is that of a chunk which an earlier walk ended with.
    is_kept: bool,
}

impl Unpacked {
    pub(super) fn content(&self) -> &[u8] {
        match self.content {
            Some(Content::AsPacked) => self.buffers.packed.get(self.data.clone()),
            Some(Content::Buffer(filled)) => self.buffers.content.get(..filled),
            None => None,
        }
        .unwrap_or_default()
    }

    /// The messages of the content, if they are decoded already.
    pub(super) fn taken_in(&mut self) -> Option<&mut TakenIn> {
        let taken = self.intake.as_mut();
        taken.filter(|_| std::mem::take(&mut self.is_taken_in))
    }

    /// Returns the offset of the content in the record; `None` if the content is compressed.
    pub(super) fn place_in_record(&self) -> Option<usize> {
        (self.content == Some(Content::AsPacked)).then_some(self.data.start)
    }

    /// Reads and decompresses the chunk at these bytes of the file.
    pub(super) fn load<G: Grammar>(
        &mut self,
        file: &FileBytes,
        bytes: &Range<u64>,
        how: LoadMode,
        decompressor: &mut Decompressor,
    ) -> Result<(), Error> {
        let Buffers { packed, content } = &mut self.buffers;
        file.read_into(packed, bytes.start, bytes.end - bytes.start)?;
        self.content = None;
        self.has_checksum = false;
        self.failure = None;
        self.is_taken_in = false;
        self.is_kept = false;
        let Some(mut chunk) = G::chunk(packed) else {
            self.failure = Some(word!("unreadable chunk header").to_owned());
            return Ok(());
        };
        // The data is a slice of `packed`, possibly truncated.
        let start = chunk.data.as_ptr() as usize - packed.as_ptr() as usize;
        self.data = start..start + chunk.data.len();
        self.has_checksum = chunk.has_checksum();
        if how == LoadMode::PlainToEnd {
            self.data.end = packed.len();
            self.content = Some(Content::AsPacked);
            return Ok(());
        }
        if how == LoadMode::Partial {
            self.content = Some(Decompressor::partial_content(&chunk, content));
            return Ok(());
        }
        if how == LoadMode::AnyLength {
            chunk.declared_bytes = chunk.data.len() as u64;
        }
        // A decompressor that panics on damaged data must not end the program or leave the walk
        // waiting.
        let unpacked = catch_unwind(AssertUnwindSafe(|| decompressor.content(&chunk, content)));
        match unpacked {
            Ok(Ok(content)) => self.content = Some(content),
            Ok(Err(reason)) => self.failure = Some(reason),
            Err(_) => {
                *decompressor = Decompressor::default();
                self.failure =
                    Some(word!("decompression: internal error of the decompressor").to_owned());
            }
        }
        Ok(())
    }

    /// Decodes the messages of verified content. `share` is that of the chunk in the bytes of the file.
    pub(super) fn take_in<G: Grammar>(&mut self, intake: &Intake<'_>, share: f64) {
        if self.failure.is_some() || !self.has_checksum {
            return;
        }
        let used = self.intake.take();
        let content = self.content();
        // A panic in a decoder must not leave the walk waiting, which will reach it again itself.
        let taken = catch_unwind(AssertUnwindSafe(|| {
            intake.take_in::<G>(content, share, used)
        }));
        self.is_taken_in = taken.is_ok();
        self.intake = taken.ok();
    }

    /// Keeps the content for the next walk, if it is all there and not too large; otherwise gives the chunk back.
    pub(super) fn keep(mut self) -> Result<Self, Self> {
        self.forget_large();
        let has_content = self.content.is_some() && self.failure.is_none();
        if !has_content || self.content().is_empty() {
            return Err(self);
        }
        self.intake = None;
        self.is_kept = true;
        Ok(self)
    }

    /// Whether the content is there already; true only once.
    pub(super) fn was_kept(&mut self) -> bool {
        std::mem::take(&mut self.is_kept)
    }

    /// Exchanges the buffers before a chunk is loaded.
    pub(super) fn exchange(&mut self, buffers: &mut Buffers) {
        self.content = None;
        std::mem::swap(&mut self.buffers, buffers);
    }

    /// Whether the content is no longer needed: all its messages are decoded, and none has a problem.
    pub(super) fn is_done_with_content(&self) -> bool {
        let taken = self.intake.as_ref().filter(|_| self.is_taken_in);
        taken.is_some_and(|taken| taken.tally.problems() == 0)
    }

    pub(super) fn forget_large(&mut self) {
        if self.buffers.forget_large() {
            self.intake = None;
            self.content = None;
        }
    }
}

impl Buffers {
    /// Frees buffers that are too large to keep, and returns whether there were any.
    pub(super) fn forget_large(&mut self) -> bool {
        let buffers = [&mut self.packed, &mut self.content];
        let mut is_large = false;
        for buffer in buffers {
            if buffer.capacity() > KEPT_BUFFER_BYTES {
                *buffer = Vec::new();
                is_large = true;
            }
        }
        is_large
    }
}

/// Way of reading a chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LoadMode {
    Whole,
    /// Ignoring the data length in the header.
    AnyLength,
    /// As much as the truncated file has.
    Partial,
    /// All bytes after the header, which are not compressed, ignoring the data length in it.
    PlainToEnd,
}
