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

/// One chunk and its content. Made once and used again.
#[derive(Default)]
pub(super) struct Unpacked {
    packed: Vec<u8>,
    buffer: Vec<u8>,
    /// Where in `packed` the data begins and ends.
    data: Range<usize>,
    content: Option<Content>,
    pub(super) header: Option<Header>,
    /// Why there is no content.
    pub(super) failure: Option<String>,
    /// Its messages, if they are taken in already; else what is used for that.
    intake: Option<TakenIn>,
    is_taken_in: bool,
}

/// What the header of a chunk tells.
#[derive(Debug, Clone, Copy)]
pub(super) struct Header {
    pub(super) has_checksum: bool,
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

    /// The messages of the content, if they have been taken in.
    pub(super) fn taken_in(&mut self) -> Option<&mut TakenIn> {
        let taken = self.intake.as_mut();
        taken.filter(|_| std::mem::take(&mut self.is_taken_in))
    }

    /// Whether the content is nothing but bytes of the file, and where it begins there.
    pub(super) fn place_in_record(&self) -> Option<usize> {
        (self.content == Some(Content::AsPacked)).then_some(self.data.start)
    }

    /// Reads and unpacks the chunk that stands in these bytes of the file.
    pub(super) fn load<G: Grammar>(
        &mut self,
        file: &FileBytes,
        bytes: &Range<u64>,
        how: How,
        decompressor: &mut Decompressor,
    ) -> Result<(), Error> {
        file.read_into(&mut self.packed, bytes.start, bytes.end - bytes.start)?;
        self.content = None;
        self.header = None;
        self.failure = None;
        self.is_taken_in = false;
        let Some(mut chunk) = G::chunk(&self.packed) else {
            self.failure = Some("unreadable chunk header".to_owned());
            return Ok(());
        };
        // The data is a part of what was read, up to where it was cut.
        let start = chunk.data.as_ptr() as usize - self.packed.as_ptr() as usize;
        self.data = start..start + chunk.data.len();
        self.header = Some(Header {
            has_checksum: chunk.has_checksum(),
        });
        if how == How::PlainToEnd {
            self.data.end = self.packed.len();
            self.content = Some(Content::AsPacked);
            return Ok(());
        }
        if how == How::Partial {
            self.content = Some(Decompressor::partial_content(&chunk, &mut self.buffer));
            return Ok(());
        }
        if how == How::AnyLength {
            chunk.declared_bytes = chunk.data.len() as u64;
        }
        // A decompressor that panics on damaged data must not take the program with it, nor leave the
        // walk waiting for this chunk.
        let buffer = &mut self.buffer;
        let unpacked = catch_unwind(AssertUnwindSafe(|| decompressor.content(&chunk, buffer)));
        match unpacked {
            Ok(Ok(content)) => self.content = Some(content),
            Ok(Err(reason)) => self.failure = Some(reason),
            Err(_) => {
                *decompressor = Decompressor::default();
                self.failure = Some("decompression: an error within the decompressor".to_owned());
            }
        }
        Ok(())
    }

    /// Takes in the messages of a content that a checksum vouches for.
    pub(super) fn take_in<G: Grammar>(&mut self, intake: &Intake<'_>) {
        let is_verified = self.header.is_some_and(|header| header.has_checksum);
        if self.failure.is_some() || !is_verified {
            return;
        }
        let used = self.intake.take();
        let content = self.content();
        // An error in a decoder must not leave the walk waiting. The walk will meet it again.
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

/// How much of a chunk is expected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum How {
    Whole,
    /// Whatever its header says of the length of its data.
    AnyLength,
    /// As much as the end of the file left.
    Partial,
    /// All bytes behind its header, which are not compressed, whatever it says of their length.
    PlainToEnd,
}
