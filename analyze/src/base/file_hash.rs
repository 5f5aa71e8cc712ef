//! Hashes of files, and of the program's own.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::SystemTime;

use anyhow::{Context, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tipwatch_binding::{hex, running_file, sha256};
use tipwatch_ingest::Log;
use tipwatch_language::word;
use tipwatch_storage::Location;

/// A file and its SHA-256.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct FileHash {
    /// Path as given, or "topic /robot_description".
    pub path: String,
    /// SHA-256, hexadecimal. Null for a file of a bucket or server of which only parts were read.
    pub sha256: Option<String>,
    /// Tag of the version (ETag) of a file of a bucket or server, if it states one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub e_tag: Option<String>,
    /// Length (bytes).
    pub bytes: u64,
}

impl FileHash {
    /// The hash, or why there is none.
    pub(crate) fn hash_text(&self) -> &str {
        let none = word!("not computed: only parts of the file were read");
        self.sha256.as_deref().unwrap_or(none)
    }

    /// The entries of a metadata record about the file of a log with this index.
    pub(crate) fn entries(&self, index: usize) -> [(String, String); 3] {
        [
            ("name", self.path.clone()),
            ("sha256", self.hash_text().to_owned()),
            ("bytes", self.bytes.to_string()),
        ]
        .map(|(key, value)| (format!("file_{index}_{key}"), value))
    }

    /// Returns the identity of this content: its hash, or else the version by its server. Includes the name, unless the server's
    /// tag is of the bytes.
    pub(crate) fn identity(&self) -> String {
        match (&self.sha256, &self.e_tag) {
            (Some(sha256), _) => sha256.clone(),
            (None, Some(tag)) if Location::is_tag_of_bytes(Path::new(&self.path), tag) => {
                format!("{} {tag}", self.bytes)
            }
            (None, Some(tag)) => format!("{} {} {tag}", self.path, self.bytes),
            (None, None) => format!("{} {}", self.path, self.bytes),
        }
    }
}

/// Hashes the files of a log. Of a file of which only parts were read there is no hash.
pub(crate) fn hash_log(log: &Log) -> Result<Vec<FileHash>> {
    let transfers = log.transfers();
    let files = log.files().iter().zip(log.whole_files());
    let hash = |(path, whole): (&PathBuf, Option<&Path>)| -> Result<FileHash> {
        let transfer = transfers.iter().find(|transfer| transfer.path == *path);
        let hash = whole.map(hash_file).transpose()?;
        Ok(FileHash {
            path: path.display().to_string(),
            bytes: match (&hash, transfer) {
                (Some(hash), _) => hash.bytes,
                (None, transfer) => transfer.map_or(0, |transfer| transfer.file_bytes),
            },
            sha256: hash.and_then(|hash| hash.sha256),
            e_tag: transfer.and_then(|transfer| transfer.e_tag.clone()),
        })
    };
    files.map(hash).collect()
}

/// The hashes of the files of a log after it was read, computed beside the reading.
pub(crate) struct LogHashes {
    log: Arc<Log>,
    /// `None` where the work is not begun.
    begun: Option<BegunHashes>,
}

struct BegunHashes {
    /// The files when the work was begun.
    before: Vec<Version>,
    work: JoinHandle<Result<Vec<FileHash>>>,
}

/// The length of a file and the time of its last change.
type Version = (u64, SystemTime);

impl LogHashes {
    /// Begins to hash the files of a log on a thread of its own, in the idle time of the processors. Files of which parts are yet
    /// to be read wait for [`Self::finish`].
    pub(crate) fn begin(log: &Arc<Log>) -> Self {
        let shared = Arc::clone(log);
        let hash = move || hash_log(&shared);
        let begin = |before: Vec<Version>| {
            let work = std::thread::Builder::new().spawn(hash).ok()?;
            Some(BegunHashes { before, work })
        };
        Self {
            log: Arc::clone(log),
            begun: versions(log).and_then(begin),
        }
    }

    /// The hashes, after the log was read. Those of files that have changed since the begin are computed anew.
    ///
    /// # Errors
    /// A file cannot be read.
    pub(crate) fn finish(self) -> Result<Vec<FileHash>> {
        let Some(BegunHashes { before, work }) = self.begun else {
            return hash_log(&self.log);
        };
        match work.join() {
            Ok(hashes) if versions(&self.log) == Some(before) => hashes,
            _ => hash_log(&self.log),
        }
    }
}

/// Returns the version of each file of a log; `None` if only parts of one were read, or it cannot be looked at.
fn versions(log: &Log) -> Option<Vec<Version>> {
    let version = |file: Option<&Path>| {
        let found = std::fs::metadata(file?).ok()?;
        Some((found.len(), found.modified().ok()?))
    };
    log.whole_files().into_iter().map(version).collect()
}

/// Hashes bytes; `path` names them.
pub(crate) fn hash_of(path: String, bytes: &[u8]) -> FileHash {
    FileHash {
        path,
        sha256: Some(sha256(bytes)),
        e_tag: None,
        bytes: bytes.len() as u64,
    }
}

/// Hashes a file.
pub(crate) fn hash_file(path: &Path) -> Result<FileHash> {
    let (hash, bytes) = tipwatch_binding::hash_file(path)
        .with_context(|| format!("{}: cannot be read", path.display()))?;
    Ok(FileHash {
        path: path.display().to_string(),
        sha256: Some(hex(&hash)),
        e_tag: None,
        bytes,
    })
}

static PROGRAM: OnceLock<Option<FileHash>> = OnceLock::new();

/// The program's own file and its hash, computed once; `None` if it cannot be read.
pub(crate) fn program() -> Option<FileHash> {
    PROGRAM
        .get_or_init(|| hash_file(&running_file().ok()?).ok())
        .clone()
}

/// States which file holds this code, where it is not the one that runs: a library that an interpreter loaded. To be
/// called before the first analysis.
pub fn set_program(file: &Path) {
    // the first one stays: what was written already names it
    let _ = PROGRAM.set(hash_file(file).ok());
}

/// Begins to hash the program's own file, so that the hash is known when it is needed.
pub(crate) fn begin_program() {
    // it only saves time
    let _ = std::thread::Builder::new().spawn(program);
}

#[cfg(test)]
mod tests {
    use std::io::{Seek, SeekFrom, Write};
    use std::time::Duration;

    use super::*;

    #[test]
    fn hashes_of_a_log_are_those_after_it_was_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.mcap");
        let tiny = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/tiny.mcap");
        std::fs::copy(tiny, &path).unwrap();
        let writable = std::fs::OpenOptions::new().write(true).open(&path);
        let mut file = writable.unwrap();
        // nothing, a longer file, another byte
        let changes: [(&[u8], SeekFrom); 3] = [
            (b"", SeekFrom::End(0)),
            (b"more", SeekFrom::End(0)),
            (b"M", SeekFrom::Start(100)),
        ];
        let mut found = Vec::new();
        let mut changed = SystemTime::now();
        for (bytes, place) in changes {
            let log = Arc::new(Log::open(&path).unwrap());
            let hashes = LogHashes::begin(&log);
            file.seek(place).unwrap();
            file.write_all(bytes).unwrap();
            if !bytes.is_empty() {
                // a later change than any clock of a file system can tell from now
                changed += Duration::from_secs(10);
                file.set_modified(changed).unwrap();
            }
            let hashes = hashes.finish().unwrap();
            assert_eq!(hashes, [hash_file(&path).unwrap()]);
            found.extend(hashes);
        }
        found.dedup();
        assert_eq!(found.len(), 3);
    }
}
