//! Where a result comes from: files by hash, versions, options.

use schemars::JsonSchema;
use serde::Serialize;

/// Where a result comes from.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Provenance {
    /// Version of the program.
    pub tipwatch_version: String,
    /// When the analysis ran, RFC 3339, UTC.
    pub analysed_at: String,
    /// The log's files.
    pub log: Vec<FileHash>,
    /// Format of the log.
    pub log_format: String,
    /// The machine file.
    pub machine_file: FileHash,
    /// The URDF: a file, or the topic that it was read from.
    pub urdf: FileHash,
    /// Where the IMU sits and who says so.
    pub imu_mounting: String,
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
