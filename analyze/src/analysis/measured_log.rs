//! A log with its measured loads and forces, for validation and identification.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Result, bail};
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::State;
use tipwatch_mechanics::machine::Machine;

use super::estimate::estimate;
use super::inputs::{self, GrossInput};
use super::measured_loads::{Comparison, LoadComparison};
use super::payload;
use super::quasi_static::{MotionLoads, StaticRows, choose};
use crate::base::estimated::EstimatedRows;
use crate::base::file_hash::{FileHash, hash_log};
use crate::base::options::Options;
use crate::load::linkage_force::{self, LinkageForce};
use crate::load::{LoadedLog, MeasuredLoads, load};

/// A log's machine and rows with the loads and forces measured beside them, for validation and identification.
pub(crate) struct MeasuredLog {
    pub(crate) loaded: LoadedLog,
    pub(crate) rows: EstimatedRows,
    pub(crate) forces: Vec<LinkageForce>,
    pub(crate) loads: MeasuredLoads,
    pub(crate) gross_inputs: Vec<GrossInput>,
    /// Hashes of the files of the log.
    pub(crate) files: Vec<FileHash>,
    /// Reasons for static rows, if there are any.
    pub(crate) notes: Vec<String>,
    /// Motion that may have occurred unobserved at static rows.
    motion: Option<Arc<StaticRows>>,
}

impl MeasuredLog {
    /// # Errors
    /// The log cannot be read, or the machine does not fit it.
    pub(crate) fn read(path: &Path, file: &MachineFile, options: &Options) -> Result<Self> {
        let log = file.open_log(path)?;
        let mut loaded = load(&log, file, options.estimator, &mut |_| {})?;
        let quasi_static = choose(&mut loaded, options)?;
        let (mut rows, quality) = estimate(&mut loaded, options)?;
        let of_payloads =
            payload::follow_signals(&log, file, &loaded, &mut rows, options.estimator)?;
        let forces = linkage_force::read_all(&log, file, &loaded);
        let loads = MeasuredLoads::read(&log, file, &loaded);
        let gross_inputs = inputs::gross_inputs(&log, file, &loaded, &rows, &quality.rotations)?;
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
            notes: (quasi_static
                .iter()
                .flat_map(|found| found.notes.iter().cloned()))
            .chain(of_payloads)
            .collect(),
            motion: quasi_static.map(|found| found.rows),
        })
    }

    /// Measured against computed loads.
    pub(crate) fn compare(&self) -> LoadComparison {
        Comparison {
            standing: &self.loaded.standing(),
            rows: &self.rows,
            measured: &self.loads,
            motion: self.motion.as_deref(),
        }
        .compare()
    }

    /// Returns the change that unobserved motion may have made to the loads of a row; `None` where all motion was observed.
    pub(crate) fn unobserved(
        &self,
        machine: &Machine,
        state: &State<f64>,
        time_ns: i64,
    ) -> Option<MotionLoads> {
        let motion = self.motion.as_ref()?;
        motion.loads(machine, state, time_ns)
    }
}
