//! Reads bytes of a file by position, of this computer or of a bucket. Files are not mapped into memory: truncating
//! a mapped file would kill the process, truncating this one is an error.

use std::{
    fs::File,
    ops::Range,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
    sync::Arc,
};

use tipwatch_can::Written;
use tipwatch_storage::Object;

use super::log_file::{LogFile, require_whole};
use crate::message::Error;

/// A file open for reading.
#[derive(Debug)]
pub(crate) struct FileBytes {
    path: PathBuf,
    file: File,
    len: u64,
    object: Option<Arc<Object>>,
}

impl FileBytes {
    /// Opens `data`; errors name the file `named`.
    pub(crate) fn open(data: &Path, named: &Path) -> Result<Self, Error> {
        let file = File::open(data).map_err(Error::io(named))?;
        let len = file.metadata().map_err(Error::io(named))?.len();
        Ok(Self {
            path: named.to_path_buf(),
            file,
            len,
            object: None,
        })
    }

    /// Opens a file of a log as far as it was written, and returns how far that is where bytes are behind it. Those of a bucket are
    /// not looked for.
    pub(crate) fn of(log_file: &LogFile) -> Result<(Self, Option<Written>), Error> {
        let own = Self::open(log_file.data(), log_file.path())?;
        if let Some(object) = log_file.object() {
            let object = Some(object.clone());
            return Ok((Self { object, ..own }, None));
        }
        let written = own.written()?;
        let is_cut = written.unwritten > 0;
        Ok((own.cut_at(written.bytes), is_cut.then_some(written)))
    }

    /// Looks for bytes behind what was written.
    pub(crate) fn written(&self) -> Result<Written, Error> {
        Written::of(&mut &self.file).map_err(Error::io(&self.path))
    }

    /// The file as if it ended here.
    pub(crate) fn cut_at(self, len: u64) -> Self {
        Self { len, ..self }
    }

    /// Whether parts are still in a bucket, so that each read may cost a request.
    pub(crate) fn is_partial(&self) -> bool {
        self.object
            .as_ref()
            .is_some_and(|object| !object.is_whole())
    }

    /// States which ranges will be read, in this order.
    pub(crate) fn plan(&self, ranges: Vec<Range<u64>>) {
        if let Some(object) = &self.object {
            object.plan(ranges);
        }
    }

    /// Transfers all of a file in a bucket, if that is allowed. `what` names the reason why parts are not enough.
    pub(crate) fn require_whole(&self, what: &str) -> Result<(), Error> {
        match &self.object {
            Some(object) => require_whole(object, what),
            None => Ok(()),
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn len(&self) -> u64 {
        self.len
    }

    /// Fills `bytes` from `offset`.
    pub(crate) fn read_at(&self, offset: u64, bytes: &mut [u8]) -> Result<(), Error> {
        if let Some(object) = &self.object {
            return Ok(object.read_at(offset, bytes)?);
        }
        self.file
            .read_exact_at(bytes, offset)
            .map_err(Error::io(&self.path))
    }

    /// The bytes of a range within the file, in a new buffer.
    pub(crate) fn read_vec(&self, offset: u64, count: u64) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        self.grow(&mut bytes, offset, count)?;
        self.read_at(offset, &mut bytes)?;
        Ok(bytes)
    }

    /// Like [`read_vec`](Self::read_vec), but into a reused buffer.
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

    /// Grows `bytes` to at least `count` bytes, if memory allows.
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
