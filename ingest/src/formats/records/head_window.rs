//! A window on the heads of records. It reads little where records are large, and reads ahead where
//! small ones follow each other.

use crate::{file::FileBytes, message::Error};

pub(super) const SMALLEST_WINDOW_BYTES: u64 = 1 << 10;
const LARGEST_WINDOW_BYTES: u64 = 256 << 10;

/// A buffer that moves along a file.
pub(crate) struct HeadWindow<'f> {
    file: &'f FileBytes,
    buffer: Vec<u8>,
    start: u64,
    filled: u64,
    size: u64,
    is_partial: bool,
}

impl<'f> HeadWindow<'f> {
    pub(crate) fn new(file: &'f FileBytes) -> Self {
        Self {
            file,
            buffer: Vec::new(),
            start: 0,
            filled: 0,
            size: SMALLEST_WINDOW_BYTES,
            is_partial: file.is_partial(),
        }
    }

    /// `count` bytes from `offset`; fewer at the end of the file.
    pub(crate) fn bytes(&mut self, offset: u64, count: u64) -> Result<&[u8], Error> {
        let count = count.min(self.file.len().saturating_sub(offset));
        let held = offset.checked_sub(self.start).is_some_and(|skipped| {
            skipped
                .checked_add(count)
                .is_some_and(|needed| needed <= self.filled)
        });
        if !held {
            self.refill(offset, count)?;
        }
        // Both fit into usize, because they lie within the buffer.
        let first = (offset - self.start) as usize;
        Ok(self
            .buffer
            .get(first..first + count as usize)
            .unwrap_or_default())
    }

    fn refill(&mut self, offset: u64, count: u64) -> Result<(), Error> {
        let end = self.start.saturating_add(self.filled);
        let goes_on = (self.start..=end).contains(&offset);
        // of a file in a bucket, every byte costs
        self.size = if goes_on && !self.is_partial {
            (self.size * 4).min(LARGEST_WINDOW_BYTES)
        } else {
            SMALLEST_WINDOW_BYTES
        };
        let available = self.file.len().saturating_sub(offset);
        let wanted = count.max(self.size).min(available);
        self.filled = 0;
        self.file.grow(&mut self.buffer, offset, wanted)?;
        let target = self.buffer.get_mut(..wanted as usize).unwrap_or_default();
        self.file.read_at(offset, target)?;
        self.start = offset;
        self.filled = wanted;
        Ok(())
    }
}
