//! Bytes of a file by position. Files are read, not mapped: a file that is cut short while it is
//! being read is then an error and not the end of the process.

use std::{
    fs::File,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
};

use crate::error::Error;

/// How much is read ahead for small records.
const WINDOW_BYTES: u64 = 256 * 1024;

/// A file that is open for reading.
#[derive(Debug)]
pub(crate) struct FileBytes {
    path: PathBuf,
    file: File,
    len: u64,
}

impl FileBytes {
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        let file = File::open(path).map_err(Error::io(path))?;
        let len = file.metadata().map_err(Error::io(path))?.len();
        Ok(Self {
            path: path.to_path_buf(),
            file,
            len,
        })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn len(&self) -> u64 {
        self.len
    }

    /// Fills `bytes` from `offset` on.
    pub(crate) fn read_at(&self, offset: u64, bytes: &mut [u8]) -> Result<(), Error> {
        self.file
            .read_exact_at(bytes, offset)
            .map_err(Error::io(&self.path))
    }

    /// The bytes of a range that lies within the file, in a buffer of their own.
    pub(crate) fn read_vec(&self, offset: u64, count: u64) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        self.grow(&mut bytes, offset, count)?;
        self.read_at(offset, &mut bytes)?;
        Ok(bytes)
    }

    /// Makes `bytes` hold at least `count` bytes, if there is so much memory.
    fn grow(&self, bytes: &mut Vec<u8>, offset: u64, count: u64) -> Result<(), Error> {
        let too_large = || Error::OutOfMemory {
            path: self.path.clone(),
            offset,
            needed_bytes: count,
        };
        let wanted = usize::try_from(count).map_err(|_| too_large())?;
        if bytes.len() < wanted {
            bytes
                .try_reserve_exact(wanted - bytes.len())
                .map_err(|_| too_large())?;
            bytes.resize(wanted, 0);
        }
        Ok(())
    }
}

/// A buffer that moves along a file, so that small records do not cost a system call each.
pub(crate) struct Window<'f> {
    file: &'f FileBytes,
    buffer: Vec<u8>,
    start: u64,
    filled: u64,
}

impl<'f> Window<'f> {
    pub(crate) fn new(file: &'f FileBytes) -> Self {
        Self {
            file,
            buffer: Vec::new(),
            start: 0,
            filled: 0,
        }
    }

    /// `count` bytes from `offset` on; fewer where the file ends.
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
        // Both fit into usize: they lie within the buffer.
        let first = (offset - self.start) as usize;
        Ok(self
            .buffer
            .get(first..first + count as usize)
            .unwrap_or_default())
    }

    fn refill(&mut self, offset: u64, count: u64) -> Result<(), Error> {
        let available = self.file.len().saturating_sub(offset);
        let wanted = count.max(WINDOW_BYTES).min(available);
        self.filled = 0;
        self.file.grow(&mut self.buffer, offset, wanted)?;
        let target = self.buffer.get_mut(..wanted as usize).unwrap_or_default();
        self.file.read_at(offset, target)?;
        self.start = offset;
        self.filled = wanted;
        Ok(())
    }
}
