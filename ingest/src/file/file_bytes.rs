//! Bytes of a file by position. Files are read, not mapped: a file that is cut short while it is
//! being read is then an error and not the end of the process.

use std::{
    fs::File,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
};

use crate::message::Error;

/// A file that is open for reading.
#[derive(Debug)]
pub(crate) struct FileBytes {
    path: PathBuf,
    file: File,
    len: u64,
}

impl FileBytes {
    /// Opens the content of a file; errors name it as it was named.
    pub(crate) fn open(data: &Path, named: &Path) -> Result<Self, Error> {
        let file = File::open(data).map_err(Error::io(named))?;
        let len = file.metadata().map_err(Error::io(named))?.len();
        Ok(Self {
            path: named.to_path_buf(),
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

    /// As [`read_vec`](Self::read_vec), into a buffer that is used again; as many bytes are taken from
    /// its front.
    pub(crate) fn read_into(
        &self,
        bytes: &mut Vec<u8>,
        offset: u64,
        count: u64,
    ) -> Result<(), Error> {
        self.grow(bytes, offset, count)?;
        bytes.truncate(count as usize);
        self.read_at(offset, bytes)
    }

    /// Makes `bytes` hold at least `count` bytes, if there is so much memory.
    pub(crate) fn grow(&self, bytes: &mut Vec<u8>, offset: u64, count: u64) -> Result<(), Error> {
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
