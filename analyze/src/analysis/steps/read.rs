//! First step: the samples of the log, and the machine that is checked against it.

use anyhow::Result;
use tipwatch_mechanics::Scope;

use super::super::evaluation;
use super::super::quasi_static::{QuasiStatic, choose};
use super::super::size;
use super::super::task::Task;
use crate::base::file_hash::LogHashes;
use crate::load::linkage_force::{self, LinkageForce};
use crate::load::{LoadedLog, load, recorder_gaps};

/// A log as it was read, before anything is concluded from it.
pub(in crate::analysis) struct ReadLog {
    pub(super) loaded: LoadedLog,
    /// The measured forces of linkages.
    pub(super) forces: Vec<LinkageForce>,
    /// The rows that are static, where the log is sparse.
    pub(super) quasi_static: Option<QuasiStatic>,
    /// Quantities computed of each row.
    pub(super) scope: Scope,
    /// The hashes of its files, which are computed beside the analysis.
    pub(super) hashes: LogHashes,
}

impl ReadLog {
    /// Reads the log; `progress` receives the number of bytes read so far.
    ///
    /// # Errors
    /// The log cannot be read, the machine does not fit it, or its table would not fit into memory.
    pub(in crate::analysis) fn read(
        task: &Task<'_>,
        progress: &mut dyn FnMut(u64),
    ) -> Result<Self> {
        let hashes = LogHashes::begin(&task.log);
        let mut loaded = load(&task.log, task.file, task.options.estimator, progress)?;
        loaded.notes.extend(recorder_gaps::note(&task.log)?);
        let quasi_static = choose(&mut loaded, &task.options)?;
        let scope = QuasiStatic::scope(quasi_static.as_ref(), evaluation::scope(&task.options));
        size::check(&loaded, &task.options, scope, task.is_kept, task.path)?;
        let forces = linkage_force::read_all(&task.log, task.file, &loaded);
        Ok(Self {
            loaded,
            forces,
            quasi_static,
            scope,
            hashes,
        })
    }
}
