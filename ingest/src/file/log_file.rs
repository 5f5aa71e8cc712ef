//! A file of a log. A zstd-compressed file is first decompressed into a private temporary file.

use std::{
    fs::File,
    io::{Read, Write},
    path::{Path, PathBuf},
};

use tempfile::TempDir;

use super::content::{Content, content_of};
use crate::message::{Error, Losses, LostPart};

/// Highest compression ratio of a real log; beyond it decompression stops.
const MOST_EXPANSION: u64 = 1000;
const COPY_BYTES: usize = 256 << 10;

/// A file of a log. The temporary file is deleted with the value.
pub(crate) struct LogFile {
    path: PathBuf,
    data: PathBuf,
    _private: Option<TempDir>,
}

impl LogFile {
    /// A file that is not compressed.
    pub(crate) fn plain(path: &Path) -> Self {
        Self {
            path: path.to_path_buf(),
            data: path.to_path_buf(),
            _private: None,
        }
    }

    /// Opens a file, decompressing it if needed.
    pub(crate) fn open(path: &Path, losses: &mut Losses) -> Result<Self, Error> {
        match content_of(path)? {
            Content::Packed(_) => unpack(path, losses),
            _ => Ok(Self::plain(path)),
        }
    }

    /// The path as given, for reports.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The path of the uncompressed content.
    pub(crate) fn data(&self) -> &Path {
        &self.data
    }
}

fn unpack(path: &Path, losses: &mut Losses) -> Result<LogFile, Error> {
    let folder = tempfile::Builder::new()
        .prefix("tipwatch-")
        .tempdir()
        .map_err(Error::io(&std::env::temp_dir()))?;
    let data = folder.path().join("log");
    let mut target = File::create_new(&data).map_err(Error::io(&data))?;
    let source = File::open(path).map_err(Error::io(path))?;
    let packed_bytes = source.metadata().map_err(Error::io(path))?.len();
    let mut decoder = zstd::stream::read::Decoder::new(source).map_err(Error::io(path))?;
    let mut buffer = vec![0; COPY_BYTES];
    let mut unpacked_bytes: u64 = 0;
    loop {
        let count = match decoder.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => count,
            Err(error) => {
                let reason = format!("after {unpacked_bytes} decompressed bytes: {error}");
                losses.lose(LostPart::Tail, path, packed_bytes..packed_bytes, reason);
                break;
            }
        };
        let bytes = buffer.get(..count).unwrap_or_default();
        target.write_all(bytes).map_err(Error::io(&data))?;
        unpacked_bytes += count as u64;
        if unpacked_bytes / MOST_EXPANSION > packed_bytes {
            let reason =
                format!("{packed_bytes} compressed bytes expand to more than {unpacked_bytes}");
            losses.lose(LostPart::Tail, path, packed_bytes..packed_bytes, reason);
            break;
        }
    }
    losses.note(format!(
        "{}: the file is compressed: byte positions refer to the decompressed content",
        path.display()
    ));
    Ok(LogFile {
        path: path.to_path_buf(),
        data,
        _private: Some(folder),
    })
}
