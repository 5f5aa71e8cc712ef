//! Identity of a log, by content.

use std::path::{Path, PathBuf};

use anyhow::Result;
use tipwatch_ingest::Log;

use crate::base::file_hash::hash_file;
use crate::base::file_hash::hash_of;

/// Hashes of a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Identity {
    /// SHA-256 of its file, or of the hashes of its files in order.
    pub(super) id: String,
    /// SHA-256 of each file.
    pub(super) files: Vec<String>,
    /// Total length of its files (bytes).
    pub(super) bytes: u64,
}

/// Hashes all files of a log.
pub(super) fn identify(path: &Path) -> Result<Identity> {
    let paths: Vec<PathBuf> = match path.is_dir() {
        true => Log::open(path)?.files().to_vec(),
        false => vec![path.into()],
    };
    let hashes = paths.iter().map(|file| hash_file(file));
    let hashes = hashes.collect::<Result<Vec<_>>>()?;
    let files: Vec<String> = hashes.iter().map(|hash| hash.sha256.clone()).collect();
    let id = match (files.as_slice(), path.is_dir()) {
        ([file], false) => file.clone(),
        (files, _) => {
            // the metadata of a rosbag2 folder is part of the log
            let metadata =
                hash_file(&path.join("metadata.yaml")).map_or(String::new(), |h| h.sha256);
            hash_of(
                String::new(),
                format!("{}\n{metadata}", files.join("\n")).as_bytes(),
            )
            .sha256
        }
    };
    Ok(Identity {
        id,
        files,
        bytes: hashes.iter().map(|hash| hash.bytes).sum(),
    })
}
