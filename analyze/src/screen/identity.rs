//! Identity of a log, by content.

use std::path::Path;

use anyhow::Result;
use tipwatch_binding::sha256;
use tipwatch_ingest::Log;
use tipwatch_storage::Location;

use crate::base::file_hash::{FileHash, hash_file, hash_log};

/// Hashes of a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Identity {
    /// SHA-256 of its file, or of the hashes of its files in order. In a bucket, where only parts are read, of the
    /// lengths and versions (ETag) of its files, with their names where a version says nothing of the bytes.
    pub(super) id: String,
    /// SHA-256 of each file, or its length and version in a bucket, with its name where that is needed.
    pub(super) files: Vec<String>,
    /// Total length of its files (bytes).
    pub(super) bytes: u64,
}

/// Hashes all files of a log. One in a bucket or in several files had to be opened for it, and is returned too: what was
/// transferred need not be fetched again.
pub(super) fn identify(path: &Path) -> Result<(Identity, Option<Log>)> {
    let is_remote = Location::is_remote_path(path);
    let log = match path.is_dir() || is_remote {
        true => Some(Log::open(path)?),
        false => None,
    };
    let hashes = match &log {
        Some(log) => hash_log(log)?,
        None => vec![hash_file(path)?],
    };
    let files: Vec<String> = hashes.iter().map(FileHash::identity).collect();
    let id = match (files.as_slice(), path.is_dir()) {
        ([file], false) if !is_remote => file.clone(),
        (files, _) => {
            // the metadata of a rosbag2 folder is part of the log
            let metadata =
                hash_file(&path.join("metadata.yaml")).map_or(String::new(), |h| h.identity());
            sha256(format!("{}\n{metadata}", files.join("\n")).as_bytes())
        }
    };
    let identity = Identity {
        id,
        files,
        bytes: hashes.iter().map(|hash| hash.bytes).sum(),
    };
    Ok((identity, log))
}
