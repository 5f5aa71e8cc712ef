//! Provenance of a result: its files and the program, the command, IMU mounting.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_language::say;
use tipwatch_mechanics::machine::ImpossibleInertia;

use super::built::built;
use super::file_hash::FileHash;
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
    /// Language of the findings and of all other sentences (ISO 639); absent if it is English.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub language: Option<String>,
    /// The case, as given with `--case`.
    pub case: Option<String>,
    /// The examiner, as given with `--examiner`.
    pub examiner: Option<String>,
    /// The log's files.
    pub log: Vec<FileHash>,
    /// What a recovered log was recovered from, the original first; empty for a log as recorded.
    pub recovered_from: Vec<RecoveredFrom>,
    /// What a log that is a clip was cut from: files with their hashes, span and events; absent for a whole log.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clip_of: Option<BTreeMap<String, String>>,
    /// Format of the log.
    pub log_format: String,
    /// The machine file.
    pub machine_file: FileHash,
    /// The URDF: a file, or the topic it was read from.
    pub urdf: FileHash,
    /// The DBC files that describe CAN messages; absent without CAN signals.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub dbc_files: Vec<FileHash>,
    /// Impossible inertias of the URDF and what replaced them; absent without any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub replaced_inertias: Vec<ReplacedInertia>,
    /// Mounting of the inertial measurement unit (IMU) and its source.
    pub imu_mounting: String,
    /// Whether, when and with what result the machine was commissioned.
    pub commissioning: String,
    /// The result of the commissioning; null without one.
    pub commissioning_file: Option<FileHash>,
}

built! {
    /// An inertia of the URDF that no body can have, and what was used instead.
    #[derive(Debug, Clone, Serialize, JsonSchema)]
    pub struct ReplacedInertia: pub(crate) fn of(inertia: &ImpossibleInertia) {} {
        /// Name of the link.
        pub link: String = inertia.link.clone(),
        /// Its mass (kg).
        pub mass_kg: f64 = inertia.mass_kg,
        /// What is wrong with the stated inertia.
        pub fault: String = inertia.fault.text(),
        /// Principal moments as stated, ascending (kg m^2).
        pub stated_kg_m2: [f64; 3] = inertia.stated_kg_m2,
        /// Principal moments that were used, ascending (kg m^2).
        pub used_kg_m2: [f64; 3] = inertia.used_kg_m2,
        /// What replaced the stated inertia.
        pub replacement: String = inertia.replacement.text(),
        /// By how much the difference can change a wheel load (N), at an angular acceleration of 5 rad/s^2.
        pub load_change_n: f64 = inertia.load_change_n,
    }
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
            [first, rest @ ..] => say!("{} and {} more files", name(&first.path), rest.len()),
        }
    }
}
