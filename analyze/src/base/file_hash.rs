//! Hashes of files, and of the program's own.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use anyhow::{Context, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// A file and its SHA-256.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct FileHash {
    /// Path as given, or "topic /robot_description".
    pub path: String,
    /// SHA-256, hexadecimal.
    pub sha256: String,
    /// Length (bytes).
    pub bytes: u64,
}

/// Hashes bytes; `path` names them.
pub(crate) fn hash_of(path: String, bytes: &[u8]) -> FileHash {
    FileHash {
        path,
        sha256: hex(&Sha256::digest(bytes)),
        bytes: bytes.len() as u64,
    }
}

/// Hashes a file block by block.
pub(crate) fn hash_file(path: &Path) -> Result<FileHash> {
    let mut file =
        std::fs::File::open(path).with_context(|| format!("{}: cannot be read", path.display()))?;
    let (mut hasher, mut buffer, mut bytes) = (Sha256::new(), vec![0; 1 << 18], 0);
    loop {
        let read = file
            .read(&mut buffer)
            .with_context(|| format!("{}: cannot be read", path.display()))?;
        if read == 0 {
            break;
        }
        hasher.update(&buffer[..read]);
        bytes += read as u64;
    }
    Ok(FileHash {
        path: path.display().to_string(),
        sha256: hex(&hasher.finalize()),
        bytes,
    })
}

static PROGRAM: OnceLock<Option<FileHash>> = OnceLock::new();

/// The program's own file and its hash, computed once; `None` if it cannot be read.
pub(crate) fn program() -> Option<FileHash> {
    PROGRAM.get_or_init(|| hash_file(&running()?).ok()).clone()
}

/// States which file holds this code, where it is not the one that runs: a library that an interpreter loaded. To be
/// called before the first analysis.
pub fn set_program(file: &Path) {
    // the first one stays: what was written already names it
    let _ = PROGRAM.set(hash_file(file).ok());
}

/// Begins to hash the program's own file, so that it is known when it is asked for.
pub(crate) fn begin_program() {
    // it only saves time
    let _ = std::thread::Builder::new().spawn(program);
}

/// The file that runs, even if it was replaced since the start.
fn running() -> Option<PathBuf> {
    let linux = Path::new("/proc/self/exe");
    if linux.exists() {
        return Some(linux.into());
    }
    std::env::current_exe().ok()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
