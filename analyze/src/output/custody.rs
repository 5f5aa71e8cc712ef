//! The custody record of an output folder, `custody.json`: inputs, program and outputs.
//!
//! The time of the analysis is here alone, so that every other output is the same bytes when the analysis is
//! repeated.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use tipwatch_binding::sha256;
use tipwatch_ingest::FileTransfer;
use tipwatch_storage::{Location, Object};

use crate::analysis::Analysis;
use crate::base::file_hash::{FileHash, hash_file, program};
use crate::base::files::write_atomically;
use crate::base::provenance::Provenance;
use crate::base::recovered::RecoveredFrom;

/// Name of the record.
pub const RECORD: &str = "custody.json";
/// Version of the record's keys.
const SCHEMA: u32 = 1;

/// Origin of an analysis: who asked for it, and how.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Origin {
    /// The command line as typed, the program first.
    pub command_line: Vec<String>,
    /// The case.
    pub case: Option<String>,
    /// The examiner.
    pub examiner: Option<String>,
}

/// The record.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Custody {
    /// Version of these keys.
    pub schema: u32,
    /// The case.
    pub case: Option<String>,
    /// The examiner.
    pub examiner: Option<String>,
    /// Time of the analysis (RFC 3339, UTC).
    pub analysed_at: String,
    /// Version of the program.
    pub tipwatch_version: String,
    /// The program's file.
    pub program: Option<FileHash>,
    /// The folder from which relative paths count.
    pub working_directory: String,
    /// The command line, the program first.
    pub command_line: Vec<String>,
    /// The log of this folder, as given.
    pub log: String,
    /// The machine file, as given.
    pub machine_file: String,
    /// Every file that was read.
    pub inputs: Vec<Input>,
    /// Logs that a recovered log was recovered from, the original first.
    pub recovered_from: Vec<RecoveredFrom>,
    /// Requests and bytes that reading the log took, for each of its files in a bucket or on a server.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub transfers: Vec<FileTransfer>,
    /// Every file that was written, but this one. Paths are relative to the folder of this record.
    pub outputs: Vec<FileHash>,
}

/// An input and its role.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// "log", "machine file", "urdf", "commissioning" or "policy".
    pub role: String,
    /// The file.
    #[serde(flatten)]
    pub file: FileHash,
}

/// The files of an analysis that its [`Provenance`] does not know.
#[derive(Debug, Clone, Copy)]
pub struct Files<'a> {
    /// The log, as given.
    pub log: &'a Path,
    /// The policy file.
    pub policy: Option<&'a Path>,
    /// Names of the files that were written.
    pub written: &'a [&'a str],
    /// Requests and bytes that reading the log took, for each of its files in a bucket or on a server.
    pub transfers: &'a [FileTransfer],
}

impl Origin {
    /// Notes the origin in the provenance of an analysis.
    pub fn note(&self, analysis: &mut Analysis) {
        let provenance = &mut analysis.provenance;
        provenance.command_line.clone_from(&self.command_line);
        provenance.case.clone_from(&self.case);
        provenance.examiner.clone_from(&self.examiner);
    }
}

/// Writes the record of an analysis into the folder of its outputs; returns the record's own SHA-256.
///
/// # Errors
/// A file cannot be read or written.
pub fn write(from: &Provenance, files: Files<'_>, folder: &Path) -> Result<String> {
    let input = |role: &str, file: FileHash| Input {
        role: role.into(),
        file,
    };
    let mut inputs: Vec<Input> = from.log.iter().map(|f| input("log", f.clone())).collect();
    let metadata = files.log.join("metadata.yaml");
    if metadata.is_file() && !from.log.iter().any(|f| Path::new(&f.path) == metadata) {
        inputs.push(input("log", hash_file(&metadata)?));
    }
    inputs.push(input("machine file", from.machine_file.clone()));
    // a URDF in the log is part of the log
    if Path::new(&from.urdf.path).is_file() {
        inputs.push(input("urdf", from.urdf.clone()));
    }
    inputs.extend(from.dbc_files.iter().map(|file| input("dbc", file.clone())));
    if let Some(file) = &from.commissioning_file {
        inputs.push(input("commissioning", file.clone()));
    }
    if let Some(policy) = files.policy {
        inputs.push(input("policy", hash_file(policy)?));
    }
    let outputs = files.written.par_iter().map(|name| -> Result<FileHash> {
        let path = (*name).into();
        let file = hash_file(&folder.join(name))?;
        Ok(FileHash { path, ..file })
    });
    let outputs: Vec<FileHash> = outputs.collect::<Result<_>>()?;
    let record = Custody {
        schema: SCHEMA,
        case: from.case.clone(),
        examiner: from.examiner.clone(),
        analysed_at: jiff::Timestamp::now()
            .strftime("%Y-%m-%dT%H:%M:%SZ")
            .to_string(),
        tipwatch_version: from.tipwatch_version.clone(),
        program: program_file(),
        working_directory: working_directory(),
        command_line: from.command_line.clone(),
        log: files.log.display().to_string(),
        machine_file: from.machine_file.path.clone(),
        inputs,
        recovered_from: from.recovered_from.clone(),
        transfers: files.transfers.to_vec(),
        outputs,
    };
    let text = serde_json::to_string_pretty(&record)?;
    write_atomically(&folder.join(RECORD), text.as_bytes())?;
    Ok(sha256(text.as_bytes()))
}

/// The program's own file, with its folder.
fn program_file() -> Option<FileHash> {
    let path = std::env::current_exe().ok();
    let named = path.map(|path| path.display().to_string());
    program().map(|file| FileHash {
        path: named.unwrap_or_else(|| file.path.clone()),
        ..file
    })
}

fn working_directory() -> String {
    std::env::current_dir().map_or(String::new(), |folder| folder.display().to_string())
}

impl Custody {
    /// Reads the record of an output folder.
    ///
    /// # Errors
    /// The folder has no record, or it is of another kind or version.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(RECORD);
        let text = std::fs::read_to_string(&path)
            .with_context(|| format!("{}: cannot be read", path.display()))?;
        let record: Self = serde_json::from_str(&text)
            .with_context(|| format!("{}: expected a custody record", path.display()))?;
        if record.schema != SCHEMA {
            let (path, found) = (path.display(), record.schema);
            bail!("{path}: expected a custody record of version {SCHEMA}, found version {found}");
        }
        Ok(record)
    }

    /// The inputs under `folder` that are missing or no longer have their recorded bytes, as sentences.
    #[must_use]
    pub fn changed_inputs(&self, folder: &Path) -> Vec<String> {
        let changed = |input: &Input| {
            let path = Path::new(&input.file.path);
            let path = match Location::is_remote_path(path) {
                true => path.into(),
                false => folder.join(path),
            };
            let what = change(&path, &input.file)?;
            Some(format!("{} {}: {what}", input.role, input.file.path))
        };
        self.inputs.iter().filter_map(changed).collect()
    }

    /// The outputs in `folder` that are missing or no longer have their recorded bytes, as sentences.
    #[must_use]
    pub fn changed_outputs(&self, folder: &Path) -> Vec<String> {
        let changed = |file: &FileHash| {
            let what = change(&folder.join(&file.path), file)?;
            Some(format!("{}: {what}", file.path))
        };
        self.outputs.iter().filter_map(changed).collect()
    }

    /// The folder from which the recorded relative paths lead to the recorded inputs: the current one, or
    /// else the recorded one. If neither does, the second value says what is wrong there.
    #[must_use]
    pub fn base(&self) -> (PathBuf, Vec<String>) {
        let here = PathBuf::new();
        if self.changed_inputs(&here).is_empty() {
            return (here, Vec::new());
        }
        let recorded = PathBuf::from(&self.working_directory);
        let changed = self.changed_inputs(&recorded);
        (recorded, changed)
    }
}

/// Describes the difference of a file from its record; `None` if there is none.
fn change(path: &Path, recorded: &FileHash) -> Option<String> {
    if Location::is_remote_path(path) {
        return change_of_object(path, recorded);
    }
    match hash_file(path) {
        Err(_) => Some("is missing or cannot be read".into()),
        Ok(found) if found.sha256 == recorded.sha256 => None,
        Ok(found) => Some(format!(
            "expected SHA-256 {}, found {}",
            recorded.hash_text(),
            found.hash_text()
        )),
    }
}

/// Describes the difference of a file of a bucket or server from its record: by its length and the tag of its version.
fn change_of_object(path: &Path, recorded: &FileHash) -> Option<String> {
    let object = match Location::of(path).and_then(|location| Object::open(&location)) {
        Ok(object) => object,
        Err(error) => return Some(format!("cannot be read: {error}")),
    };
    let version = |bytes: u64, tag: Option<&str>| {
        let tag = tag.map_or("without a tag of its version".into(), |tag| {
            format!("version {tag}")
        });
        format!("{bytes} bytes, {tag}")
    };
    let expected = version(recorded.bytes, recorded.e_tag.as_deref());
    let found = version(object.size(), object.e_tag());
    match recorded.e_tag.is_some() && expected == found {
        true => None,
        false => Some(format!("expected {expected}, found {found}")),
    }
}
