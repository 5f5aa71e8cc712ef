//! Provenance of a result: hashes of its files, program version, IMU mounting.

use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result};
use schemars::JsonSchema;
use serde::Serialize;
use sha2::{Digest, Sha256};

/// Provenance of a result.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Provenance {
    /// Version of the program.
    pub tipwatch_version: String,
    /// Time of the analysis (RFC 3339, UTC).
    pub analysed_at: String,
    /// The log's files.
    pub log: Vec<FileHash>,
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
#[derive(Debug, Clone, Serialize, JsonSchema)]
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

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
