//! A log with what was measured beside it, for validation and identification.

use std::path::Path;

use anyhow::{Result, bail};
use tipwatch_binding::MachineFile;

use super::estimate::open;
use super::inputs::{self, GrossInput};
use super::measured_loads::{Comparison, LoadComparison};
use super::payload;
use crate::base::estimated::EstimatedRows;
use crate::base::file_hash::{FileHash, hash_log};
use crate::base::options::Options;
use crate::load::linkage_force::{self, LinkageForce};
use crate::load::{LoadedLog, MeasuredLoads};

/// A log's machine and rows with what was measured beside them, for validation and identification.
pub(crate) struct MeasuredLog {
    pub(crate) loaded: LoadedLog,
    pub(crate) rows: EstimatedRows,
    pub(crate) forces: Vec<LinkageForce>,
    pub(crate) loads: MeasuredLoads,
    pub(crate) gross_inputs: Vec<GrossInput>,
    /// Hashes of the files of the log.
    pub(crate) files: Vec<FileHash>,
}

impl MeasuredLog {
    /// # Errors
    /// The log cannot be read, or the machine does not fit it.
    pub(crate) fn read(path: &Path, file: &MachineFile) -> Result<Self> {
        let (log, mut loaded, rows) = open(path, file, &Options::default())?;
        let forces = linkage_force::read_all(&log, file, &loaded);
        let loads = MeasuredLoads::read(&log, file, &loaded);
        let gross_inputs = inputs::gross_inputs(&log, file, &loaded, &rows)?;
        loaded.check_read()?;
        if rows.is_empty() {
            bail!(
                "{}: expected usable joint states, found none",
                path.display()
            );
        }
        if loaded
            .machine
            .payloads()
            .iter()
            .any(|payload| payload.is_estimated)
        {
            payload::estimate_all(file, &mut loaded.machine, &forces, &rows)?;
        }
        Ok(Self {
            loaded,
            rows,
            forces,
            loads,
            gross_inputs,
            files: hash_log(&log)?,
        })
    }

    /// Measured against computed loads.
    pub(crate) fn compare(&self) -> LoadComparison {
        Comparison {
            machine: &self.loaded.machine,
            rows: &self.rows,
            measured: &self.loads,
        }
        .compare()
    }
}
