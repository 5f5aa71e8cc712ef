//! The version of an analysis: everything except the log that its result depends on.

use anyhow::Result;
use serde::Serialize;
use tipwatch_binding::{MachineFile, sha256};
use tipwatch_ingest::{ReadOptions, read_options};

use super::record::RECORD_SCHEMA;
use crate::base::file_hash::{FileHash, hash_file};
use crate::base::options::Options;
use crate::tables::summary;

/// The inputs of a result, in the order in which they are hashed.
#[derive(Serialize)]
struct Ingredients<'a> {
    tipwatch: &'a str,
    summary_schema: u32,
    record_schema: u32,
    machine_file: &'a str,
    urdf: Option<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    dbc_files: Vec<String>,
    options: &'a Options,
    /// What was stated of the logs; absent if nothing was.
    #[serde(skip_serializing_if = "Option::is_none")]
    reading: Option<ReadOptions>,
}

/// The version of analyses with this machine and these options: the same log and the same version give
/// the same result.
///
/// # Errors
/// A DBC file of the machine cannot be read.
pub(super) fn analysis_version(
    machine: &MachineFile,
    urdf: Option<&FileHash>,
    options: &Options,
) -> Result<String> {
    let dbc_files = machine.dbc_files();
    let dbc_files = dbc_files.iter().map(|file| Ok(hash_file(file)?.identity()));
    let ingredients = Ingredients {
        tipwatch: env!("CARGO_PKG_VERSION"),
        summary_schema: summary::SCHEMA,
        record_schema: RECORD_SCHEMA,
        machine_file: &machine_sha256(machine),
        urdf: urdf.map(FileHash::identity),
        dbc_files: dbc_files.collect::<Result<_>>()?,
        options,
        reading: Some(read_options()).filter(|stated| *stated != ReadOptions::default()),
    };
    let text = serde_json::to_string(&ingredients)?;
    let mut hash = sha256(text.as_bytes());
    hash.truncate(16);
    Ok(hash)
}

/// Hash of the URDF that a machine file names. Without one, that in the log is part of the log.
///
/// # Errors
/// It cannot be read.
pub(super) fn urdf_hash(machine: &MachineFile) -> Result<Option<FileHash>> {
    machine.urdf_path().map(|path| hash_file(&path)).transpose()
}

/// SHA-256 of a machine file.
pub(super) fn machine_sha256(machine: &MachineFile) -> String {
    sha256(machine.effective_text().as_bytes())
}
