//! The analysis of one log, in six steps: read, estimate, prepare, check, evaluate, study.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;

use super::advice::Hypothesis;
pub use super::gather::{Prepared, RowSink};
use super::steps::{CheckedLog, EstimatedLog, EvaluatedLog, PreparedMachine, ReadLog, study};
use super::task::Task;
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

/// Analyses one log under hypotheses and keeps the whole table. Sensors are not compared with each other: the evidence of their
/// motion is known from the analysis of the log as recorded. Rotations of the platform are not events: they are those recorded.
///
/// # Errors
/// The log cannot be read, the machine does not fit it, or no row remains.
pub(crate) fn analyse_supposing(
    path: &Path,
    file: &MachineFile,
    options: Options,
    hypotheses: &[Hypothesis],
    recorded: &Analysis,
) -> Result<Analysis> {
    let supposed = Some((hypotheses, recorded));
    analyse_whole(path, file, options, supposed, &mut |_| {})
}

fn analyse_whole(
    path: &Path,
    file: &MachineFile,
    options: Options,
    supposed: Option<(&[Hypothesis], &Analysis)>,
    progress: &mut dyn FnMut(u64),
) -> Result<Analysis> {
    let task = Task {
        path,
        file,
        log: Arc::new(file.open_log(path)?),
        options,
        is_kept: true,
        supposed,
    };
    let (analysis, whole) = run(&task, progress, |_| Ok(Whole::default()))?;
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
    let log = file.open_log(path)?;
    analyse_opened(path, log, file, options, progress, begin)
}

/// Analyses a log as [`analyse_into`] does, but one that was opened by [`MachineFile::open_log`]; `path` is the one that results
/// name.
///
/// # Errors
/// As [`analyse_into`].
pub(crate) fn analyse_opened<S: RowSink>(
    path: &Path,
    log: Log,
    file: &MachineFile,
    options: Options,
    progress: &mut dyn FnMut(u64),
    begin: impl FnOnce(&Prepared<'_>) -> Result<S>,
) -> Result<(Analysis, S)> {
    let task = Task {
        path,
        file,
        log: Arc::new(log),
        options,
        is_kept: false,
        supposed: None,
    };
    run(&task, progress, begin)
}

/// Takes the six steps.
fn run<S: RowSink>(
    task: &Task<'_>,
    progress: &mut dyn FnMut(u64),
    begin: impl FnOnce(&Prepared<'_>) -> Result<S>,
) -> Result<(Analysis, S)> {
    let mut read = ReadLog::read(task, progress)?;
    let mut estimated = EstimatedLog::estimate(task, &mut read)?;
    let prepared = PreparedMachine::prepare(task, &mut read, &mut estimated)?;
    // from here on neither the machine nor a sample changes
    let read = read;
    let checked = CheckedLog::check(task, &read, &mut estimated, &prepared);
    let evaluated = EvaluatedLog::evaluate(task, &read, estimated, &prepared)?;
    study(task, read, prepared, checked, evaluated, begin)
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
