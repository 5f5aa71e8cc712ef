//! The analysis of one log, in six steps: read, estimate, prepare, check, evaluate, study.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;

use super::advice::Hypothesis;
pub use super::folds::{Prepared, RowSink};
use super::steps::{CheckedLog, EstimatedLog, EvaluatedLog, PreparedMachine, ReadLog, study};
use crate::analysis::Analysis;
use crate::base::options::Options;
use crate::base::rows::Rows;

/// Analyses one log and keeps the whole table; `progress` receives the number of bytes read so far.
///
/// # Errors
/// The log cannot be read, the machine does not fit it, or no row remains.
pub fn analyse(
    path: &Path,
    file: &MachineFile,
    options: Options,
    progress: &mut dyn FnMut(u64),
) -> Result<Analysis> {
    analyse_whole(path, file, options, None, progress)
}

/// Analyses one log under hypotheses and keeps the whole table. Sensors are not compared with each other, and rotations of
/// the platform are not events: they are what was recorded.
///
/// # Errors
/// The log cannot be read, the machine does not fit it, or no row remains.
pub(crate) fn analyse_supposing(
    path: &Path,
    file: &MachineFile,
    options: Options,
    hypotheses: &[Hypothesis],
) -> Result<Analysis> {
    analyse_whole(path, file, options, Some(hypotheses), &mut |_| {})
}

fn analyse_whole(
    path: &Path,
    file: &MachineFile,
    options: Options,
    hypotheses: Option<&[Hypothesis]>,
    progress: &mut dyn FnMut(u64),
) -> Result<Analysis> {
    let task = Task {
        path,
        file,
        log: Arc::new(file.open_log(path)?),
        options,
        is_kept: true,
        hypotheses,
    };
    let (analysis, whole) = task.run(progress, |_| Ok(Whole::default()))?;
    if let Some(rows) = whole.rows {
        analysis.rows.keep(rows);
    }
    Ok(analysis)
}

/// Analyses one log without keeping its table. The sink that `begin` makes receives the rows block by block.
///
/// # Errors
/// The log cannot be read, the machine does not fit it, no row remains, or the sink fails.
pub fn analyse_into<S: RowSink>(
    path: &Path,
    file: &MachineFile,
    options: Options,
    progress: &mut dyn FnMut(u64),
    begin: impl FnOnce(&Prepared<'_>) -> Result<S>,
) -> Result<(Analysis, S)> {
    let task = Task {
        path,
        file,
        log: Arc::new(file.open_log(path)?),
        options,
        is_kept: false,
        hypotheses: None,
    };
    task.run(progress, begin)
}

/// A log to analyse, and how.
pub(super) struct Task<'a> {
    pub(super) path: &'a Path,
    pub(super) file: &'a MachineFile,
    pub(super) log: Arc<Log>,
    pub(super) options: Options,
    /// Whether the whole table is kept.
    pub(super) is_kept: bool,
    /// What is supposed of it instead of what was recorded, if anything is.
    pub(super) hypotheses: Option<&'a [Hypothesis]>,
}

impl Task<'_> {
    /// Whether the analysis is of what was recorded, with nothing supposed.
    pub(super) fn is_recorded(&self) -> bool {
        self.hypotheses.is_none()
    }

    fn run<S: RowSink>(
        self,
        progress: &mut dyn FnMut(u64),
        begin: impl FnOnce(&Prepared<'_>) -> Result<S>,
    ) -> Result<(Analysis, S)> {
        let mut read = ReadLog::read(&self, progress)?;
        let mut estimated = EstimatedLog::estimate(&self, &mut read)?;
        let prepared = PreparedMachine::prepare(&self, &mut read, &mut estimated)?;
        // from here on neither the machine nor a sample changes
        let read = read;
        let checked = CheckedLog::check(&self, &read, &mut estimated, &prepared);
        let evaluated = EvaluatedLog::evaluate(&self, &read, estimated, &prepared)?;
        study(&self, read, prepared, checked, evaluated, begin)
    }
}

/// Collects all rows.
#[derive(Default)]
struct Whole {
    rows: Option<Rows>,
}

impl RowSink for Whole {
    fn take(&mut self, rows: &Arc<Rows>) -> Result<()> {
        let next = Rows::clone(rows);
        match &mut self.rows {
            Some(rows) => rows.append(next),
            None => self.rows = Some(next),
        }
        Ok(())
    }
}
