//! One log as a task of an engine: what a worker of Ray or Dask calls, and what the driver writes when the
//! worker is lost.

use std::path::{Path, PathBuf};

use anyhow::Result;
use tipwatch_storage::redact;

use super::failure::FailureKind;
use super::fleet_file::Fleet;
use super::inputs::{self, RequestedLogs};
use super::one_log::{CurrentRun, Screening, empty_record};
use super::place::Place;
use super::record::Outcome;
use super::request::{Reports, Update};
use super::store::{Before, Store};
use super::workers;
use crate::base::options::Options;

/// The analysis of single logs into one place.
#[derive(Debug)]
pub struct Task<'a> {
    /// The place of records and reports.
    pub records: &'a Path,
    /// Options of the analysis.
    pub options: Options,
    /// Which logs get a report.
    pub reports: Reports,
}

/// Result of a task.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TaskResult {
    /// Kind and reason of the failure; `None` for an analysed log.
    pub failure: Option<(FailureKind, String)>,
    /// Whether the result is from an earlier task.
    pub is_from_before: bool,
}

impl Task<'_> {
    /// Analyses a log, unless its content was analysed before, and writes its record.
    ///
    /// # Errors
    /// The record cannot be written. A log that cannot be analysed is not an error.
    pub fn run(&self, log: &Path, fleet: &Fleet) -> Result<TaskResult> {
        let place = Place::at(self.records)?;
        let screening = Screening {
            fleet,
            found: None,
            options: self.options,
            reports: self.reports,
            before: Before::OnDemand,
            store: Store::of(&place),
            place,
            attempts: None,
            current: CurrentRun::default(),
        };
        let screened = workers::on_own_thread(|| screening.screen(log))??;
        let failure = match screened.record.result {
            Outcome::Failed { kind, reason } => Some((kind, reason)),
            Outcome::Analysed { .. } => None,
        };
        Ok(TaskResult {
            failure,
            is_from_before: screened.is_from_before,
        })
    }

    /// The logs of a run over a fleet, each with the estimated memory of its analysis (bytes), the largest first, and what the
    /// gathering must know of the search. Notes about them go to `notify`. A place that the storage does not list has the record
    /// of its failure then, and is none of the logs.
    ///
    /// # Errors
    /// None of the named places exists, a pattern matches nothing, a manifest cannot be read, there is no log at all, or a
    /// record cannot be written.
    pub fn logs(
        &self,
        requested: &[PathBuf],
        fleet: &Fleet,
        notify: &dyn Fn(Update<'_>),
    ) -> Result<(Vec<(PathBuf, u64)>, RequestedLogs)> {
        inputs::require_any(requested)?;
        let found = inputs::find(requested, self.records)?;
        let notes = found.notes().into_iter().chain(fleet.note());
        notes.for_each(|note| notify(Update::Note(note)));
        let mut logs = Vec::new();
        for log in &found.logs {
            match found.refusal(log) {
                Some(reason) => self.fail(log, FailureKind::Storage, reason)?,
                None => logs.push((log.clone(), workers::memory_of(found.size_of(log)))),
            }
        }
        logs.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
        Ok((logs, found))
    }

    /// Number of logs that have a record.
    ///
    /// # Errors
    /// The place cannot be listed.
    pub fn records(&self) -> Result<usize> {
        Ok(Store::of(&Place::at(self.records)?).index()?.len())
    }

    /// Writes the failure of a log whose worker could not do it.
    ///
    /// # Errors
    /// The record cannot be written.
    pub fn fail(&self, log: &Path, kind: FailureKind, reason: &str) -> Result<()> {
        let mut record = empty_record(log, &self.options);
        record.result = Outcome::Failed {
            kind,
            reason: redact(reason),
        };
        Store::of(&Place::at(self.records)?).save(&record)
    }
}
