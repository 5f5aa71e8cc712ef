//! A file of a log. A file that is compressed as a whole is first decompressed into a private temporary file.

use std::{
    fs::File,
    io::{self, BufReader, BufWriter, Read, Seek, Write},
    path::{Path, PathBuf},
    sync::Arc,
};

use serde::{Deserialize, Serialize};
use tempfile::TempDir;
use tipwatch_language::say;
use tipwatch_storage::{ErrorKind, Object};

use super::{content::LONGEST_MAGIC_BYTES, packing::Packing, recode::Recoding};
use crate::message::{Error, Losses, LostPart};

/// Highest compression ratio of a real log; beyond it decompression stops.
const MOST_EXPANSION: u64 = 1000;
/// Highest ratio by which a text grows as a table, where most cells are empty.
const MOST_TEXT_EXPANSION: u64 = 100;
const COPY_BYTES: usize = 256 << 10;

/// A file of a log. Temporary files are deleted with the value.
pub(crate) struct LogFile {
    path: PathBuf,
    data: PathBuf,
    object: Option<Arc<Object>>,
    _private: Option<TempDir>,
}

/// Requests and bytes that reading a file of a bucket or server has taken so far.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileTransfer {
    /// The file, without secrets.
    pub path: PathBuf,
    /// Its length (bytes).
    pub file_bytes: u64,
    /// The tag of the version that was read, if the server states one.
    pub e_tag: Option<String>,
    /// Requests sent, with those that failed.
    pub requests: u64,
    /// Bytes received.
    pub bytes: u64,
}

impl LogFile {
    /// A local file that is not compressed.
    pub(crate) fn plain(path: &Path) -> Self {
        Self {
            path: path.to_path_buf(),
            data: path.to_path_buf(),
            object: None,
            _private: None,
        }
    }

    /// A file of a bucket or server.
    pub(crate) fn remote(path: &Path, object: Arc<Object>) -> Self {
        Self {
            path: path.to_path_buf(),
            data: object.data().to_path_buf(),
            object: Some(object),
            _private: None,
        }
    }

    /// The file with its content decompressed.
    pub(crate) fn unpacked(self, losses: &mut Losses) -> Result<Self, Error> {
        self.require_whole("compressed as a whole")?;
        let (private, data) = unpack(&self.path, &self.data, losses)?;
        Ok(Self {
            data,
            _private: Some(private),
            ..self
        })
    }

    /// The file with its text in the form of its format.
    pub(crate) fn recoded(self, recoding: Recoding, losses: &mut Losses) -> Result<Self, Error> {
        self.require_whole("a text that is read as a whole")?;
        let (private, data, target) = private_file()?;
        let source = File::open(&self.data).map_err(Error::io(&self.path))?;
        let bytes = source.metadata().map_err(Error::io(&self.path))?.len();
        let mut bounded = Bounded::new(BufWriter::new(target), bytes);
        let recoded = recoding.recode(&mut BufReader::new(source), &mut bounded);
        let written_bytes = bounded.written_bytes;
        if bounded.is_full() {
            let reason = say!("{bytes} bytes of text become more than {written_bytes}");
            losses.lose(LostPart::Tail, &self.path, bytes..bytes, reason);
        } else {
            for left_out in recoded.map_err(Error::io(&self.path))? {
                losses.note(format!("{}: {left_out}", self.path.display()));
            }
        }
        bounded.flush().map_err(Error::io(&data))?;
        losses.note(format!("{}: {}", self.path.display(), recoding.note()));
        Ok(Self {
            data,
            _private: Some(private),
            ..self
        })
    }

    /// The path as given, for reports.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the path of the uncompressed content. Of a file in a bucket it has only the transferred parts.
    pub(crate) fn data(&self) -> &Path {
        &self.data
    }

    /// Returns the path of the file that has all bytes as they were recorded; `None` while only parts of it were transferred.
    pub(crate) fn whole(&self) -> Option<&Path> {
        match &self.object {
            None => Some(&self.path),
            Some(object) => object.is_whole().then(|| object.data()),
        }
    }

    /// The object whose parts are the content.
    pub(crate) fn object(&self) -> Option<&Arc<Object>> {
        let is_content = |object: &&Arc<Object>| object.data() == self.data;
        self.object.as_ref().filter(is_content)
    }

    /// Requests and bytes so far; `None` for a local file.
    pub(crate) fn transfer(&self) -> Option<FileTransfer> {
        let object = self.object.as_ref()?;
        let transfer = object.transfer();
        Some(FileTransfer {
            path: self.path.clone(),
            file_bytes: object.size(),
            e_tag: object.e_tag().map(str::to_owned),
            requests: transfer.requests,
            bytes: transfer.bytes,
        })
    }

    /// Transfers a file of a bucket as a whole, if that is allowed. `what` names the reason why parts are not enough.
    pub(crate) fn require_whole(&self, what: &str) -> Result<(), Error> {
        match &self.object {
            Some(object) => require_whole(object, what),
            None => Ok(()),
        }
    }
}

/// Transfers an object as a whole, if that is allowed.
pub(super) fn require_whole(object: &Object, what: &str) -> Result<(), Error> {
    if !tipwatch_storage::whole_reads() && !object.is_whole() {
        let detail = format!(
            "the file is {what}: expected permission to transfer all of its {} bytes (--fetch-whole)",
            object.size()
        );
        return Err(Error::Storage(tipwatch_storage::Error {
            place: object.location().to_string(),
            kind: ErrorKind::WholeRead,
            detail,
        }));
    }
    Ok(object.require_all()?)
}

/// A new file in a private folder.
fn private_file() -> Result<(TempDir, PathBuf, File), Error> {
    let folder = tempfile::Builder::new()
        .prefix("tipwatch-")
        .tempdir()
        .map_err(Error::io(&std::env::temp_dir()))?;
    let data = folder.path().join("log");
    let target = File::create_new(&data).map_err(Error::io(&data))?;
    Ok((folder, data, target))
}

/// Refuses more than a text can honestly become.
struct Bounded<W> {
    target: W,
    source_bytes: u64,
    written_bytes: u64,
}

impl<W: Write> Bounded<W> {
    fn new(target: W, source_bytes: u64) -> Self {
        Self {
            target,
            source_bytes,
            written_bytes: 0,
        }
    }

    fn is_full(&self) -> bool {
        self.written_bytes / MOST_TEXT_EXPANSION > self.source_bytes
    }
}

impl<W: Write> Write for Bounded<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.is_full() {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        let count = self.target.write(bytes)?;
        self.written_bytes += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.target.flush()
    }
}

/// Decompresses a file into a private folder; `path` names it.
fn unpack(path: &Path, packed: &Path, losses: &mut Losses) -> Result<(TempDir, PathBuf), Error> {
    let (folder, data, mut target) = private_file()?;
    let mut source = File::open(packed).map_err(Error::io(path))?;
    let packed_bytes = source.metadata().map_err(Error::io(path))?.len();
    let mut first_bytes = Vec::new();
    let mut read = (&mut source).take(LONGEST_MAGIC_BYTES);
    read.read_to_end(&mut first_bytes)
        .map_err(Error::io(path))?;
    source.rewind().map_err(Error::io(path))?;
    let packing = Packing::of(&first_bytes).unwrap_or(Packing::Zstd);
    let mut decoder = packing.unpack(source).map_err(Error::io(path))?;
    let mut buffer = vec![0; COPY_BYTES];
    let mut unpacked_bytes: u64 = 0;
    loop {
        let count = match decoder.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => count,
            Err(error) => {
                let reason = say!("after {unpacked_bytes} decompressed bytes: {error}");
                losses.lose(LostPart::Tail, path, packed_bytes..packed_bytes, reason);
                break;
            }
        };
        let bytes = buffer.get(..count).unwrap_or_default();
        target.write_all(bytes).map_err(Error::io(&data))?;
        unpacked_bytes += count as u64;
        if unpacked_bytes / MOST_EXPANSION > packed_bytes {
            let reason =
                say!("{packed_bytes} compressed bytes expand to more than {unpacked_bytes}");
            losses.lose(LostPart::Tail, path, packed_bytes..packed_bytes, reason);
            break;
        }
    }
    losses.note(say!(
        "{}: the file is compressed: byte positions refer to the decompressed content",
        path.display()
    ));
    Ok((folder, data))
}
