//! Origin of a result.

use std::path::PathBuf;

use anyhow::Result;
use tipwatch_binding::{Commissioning, MachineFile, NOT_COMMISSIONED, Urdf, commissioning_of};
use tipwatch_ingest::{Log, metadata_records};
use tipwatch_language::{is_english, tag, told};

use crate::base::clip;
use crate::base::file_hash::{FileHash, hash_file, hash_of, program};
use crate::base::provenance::{Provenance, ReplacedInertia};
use crate::base::recovered::RecoveredFrom;
use crate::load::LoadedLog;

/// Reads the commissioning that the machine file names, and checks it against the machine of the log; `None` if the file names
/// none.
///
/// # Errors
/// The commissioning cannot be read, is of another machine, or contradicts the machine file.
pub(super) fn commissioning(
    file: &MachineFile,
    loaded: &LoadedLog,
) -> Result<Option<(PathBuf, Commissioning)>> {
    let urdf = Urdf {
        name: loaded.urdf.path.clone(),
        text: loaded.urdf_text.clone(),
    };
    Ok(commissioning_of(file, &urdf)?)
}

/// The files, the program and the records of the log behind a result.
///
/// # Errors
/// A file or a record of the log cannot be read.
pub(super) fn provenance(
    log: &Log,
    log_hashes: Vec<FileHash>,
    file: &MachineFile,
    loaded: &LoadedLog,
    commissioning: Option<&(PathBuf, Commissioning)>,
) -> Result<Provenance> {
    let records = metadata_records(log)?;
    Ok(Provenance {
        clip_of: clip::origin(&records),
        commissioning: commissioning.map_or(told(NOT_COMMISSIONED).into(), |(_, found)| {
            found.statement()
        }),
        commissioning_file: commissioning.map(|(path, _)| hash_file(path)).transpose()?,
        tipwatch_version: env!("CARGO_PKG_VERSION").into(),
        program: program().map(|file| FileHash {
            path: "tipwatch".into(),
            ..file
        }),
        command_line: Vec::new(),
        language: (!is_english()).then(|| tag().into()),
        case: None,
        examiner: None,
        recovered_from: RecoveredFrom::all(&records),
        log: log_hashes,
        log_format: log.format().to_string(),
        machine_file: hash_of(file.path.display().to_string(), file.text.as_bytes()),
        urdf: loaded.urdf.clone(),
        dbc_files: file
            .dbc_files()
            .iter()
            .map(|file| hash_file(file))
            .collect::<Result<_>>()?,
        replaced_inertias: (loaded.machine.replaced_inertias().iter())
            .map(ReplacedInertia::of)
            .collect(),
        imu_mounting: loaded.machine.imu().source.to_string(),
    })
}
