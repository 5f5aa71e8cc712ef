//! One chunk and its content after unpacking.

use std::{
    ops::Range,
    panic::{AssertUnwindSafe, catch_unwind},
};

use super::{
    decompress::{Content, Decompressor},
    grammar::Grammar,
    intake::{Intake, TakenIn},
};
use crate::{file::FileBytes, message::Error};

/// Buffers that grew beyond this are not kept.
const KEPT_BUFFER_BYTES: usize = 32 << 20;

/// One chunk and its content; reused for other chunks.
#[derive(Default)]
pub(super) struct Unpacked {
    packed: Vec<u8>,
    buffer: Vec<u8>,
    /// The range of the data in `packed`.
    data: Range<usize>,
    content: Option<Content>,
    /// Whether a checksum covers the content.
    pub(super) has_checksum: bool,
    /// Why the content is not available.
    pub(super) failure: Option<String>,
    /// Its decoded messages if `is_taken_in`, else buffers to decode into.
    intake: Option<TakenIn>,
    is_taken_in: bool,
}

impl Unpacked {
    pub(super) fn content(&self) -> &[u8] {
        match self.content {
            Some(Content::AsPacked) => self.packed.get(self.data.clone()),
            Some(Content::Buffer(filled)) => self.buffer.get(..filled),
            None => None,
        }
        .unwrap_or_default()
    }

    /// The messages of the content, if they are decoded already.
    pub(super) fn taken_in(&mut self) -> Option<&mut TakenIn> {
        let taken = self.intake.as_mut();
        taken.filter(|_| std::mem::take(&mut self.is_taken_in))
    }

    /// Offset of the content in the record, if it is not compressed.
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
        file.read_into(&mut self.packed, bytes.start, bytes.end - bytes.start)?;
        self.content = None;
        self.has_checksum = false;
        self.failure = None;
        self.is_taken_in = false;
        let Some(mut chunk) = G::chunk(&self.packed) else {
            self.failure = Some("unreadable chunk header".to_owned());
            return Ok(());
        };
        // The data is a slice of `packed`, possibly truncated.
        let start = chunk.data.as_ptr() as usize - self.packed.as_ptr() as usize;
        self.data = start..start + chunk.data.len();
        self.has_checksum = chunk.has_checksum();
        if how == LoadMode::PlainToEnd {
            self.data.end = self.packed.len();
            self.content = Some(Content::AsPacked);
            return Ok(());
        }
        if how == LoadMode::Partial {
            self.content = Some(Decompressor::partial_content(&chunk, &mut self.buffer));
            return Ok(());
        }
        if how == LoadMode::AnyLength {
            chunk.declared_bytes = chunk.data.len() as u64;
        }
        // A decompressor that panics on damaged data must not end the program or leave the walk
        // waiting.
        let buffer = &mut self.buffer;
        let unpacked = catch_unwind(AssertUnwindSafe(|| decompressor.content(&chunk, buffer)));
        match unpacked {
            Ok(Ok(content)) => self.content = Some(content),
            Ok(Err(reason)) => self.failure = Some(reason),
            Err(_) => {
                *decompressor = Decompressor::default();
                self.failure = Some("decompression: internal error of the decompressor".to_owned());
            }
        }
        Ok(())
    }

    /// Decodes the messages of verified content.
    pub(super) fn take_in<G: Grammar>(&mut self, intake: &Intake<'_>) {
        if self.failure.is_some() || !self.has_checksum {
            return;
        }
        let used = self.intake.take();
        let content = self.content();
        // A panic in a decoder must not leave the walk waiting, which will reach it again itself.
        let taken = catch_unwind(AssertUnwindSafe(|| intake.take_in::<G>(content, used)));
        self.is_taken_in = taken.is_ok();
        self.intake = taken.ok();
    }

    pub(super) fn forget_large(&mut self) {
        for buffer in [&mut self.packed, &mut self.buffer] {
            if buffer.capacity() > KEPT_BUFFER_BYTES {
                *buffer = Vec::new();
                self.intake = None;
            }
        }
    }
}

/// How a chunk is read.
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
