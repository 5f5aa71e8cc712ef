//! Provenance of a result: hashes of its files and of the program, the command, IMU mounting.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use anyhow::{Context, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::recovered::RecoveredFrom;

/// Provenance of a result: what it depends on. The time of the analysis is not part of it, so that the same
/// analysis gives the same bytes; `custody.json` has it.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Provenance {
    /// Version of the program.
    pub tipwatch_version: String,
    /// The program's own file, without its folder; null if it could not be read.
    pub program: Option<FileHash>,
    /// The command line; empty if the analysis was not started by one.
    pub command_line: Vec<String>,
    /// The case, as given with `--case`.
    pub case: Option<String>,
    /// The examiner, as given with `--examiner`.
    pub examiner: Option<String>,
    /// The log's files.
    pub log: Vec<FileHash>,
    /// What a recovered log was recovered from, the original first; empty for a log as recorded.
    pub recovered_from: Vec<RecoveredFrom>,
    /// Format of the log.
    pub log_format: String,
    /// The machine file.
    pub machine_file: FileHash,
    /// The URDF: a file, or the topic it was read from.
    pub urdf: FileHash,
    /// Mounting of the inertial measurement unit (IMU) and its source.
    pub imu_mounting: String,
}

impl Provenance {
    /// Names of the log's files without their folders.
    pub(crate) fn log_name(&self) -> String {
        let name = |path: &str| {
            Path::new(path)
                .file_name()
                .map_or(path.to_string(), |name| name.to_string_lossy().into())
        };
        match self.log.as_slice() {
            [] => "log".to_string(),
            [file] => name(&file.path),
            [first, rest @ ..] => format!("{} and {} more files", name(&first.path), rest.len()),
        }
    }
}

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

/// The program's own file and its hash, computed once; `None` if it cannot be read.
pub(crate) fn program() -> Option<FileHash> {
    static PROGRAM: OnceLock<Option<FileHash>> = OnceLock::new();
    PROGRAM.get_or_init(|| hash_file(&running()?).ok()).clone()
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
