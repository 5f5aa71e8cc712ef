//! The analyses of a fleet as tasks of an engine: the functions that driver and workers call
//! (`analyze/python/tipwatch/_engines`).

use std::ffi::OsString;
use std::path::{PathBuf, absolute};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result, anyhow, bail};
use pyo3::prelude::*;
use tipwatch_analyze::base::options::{Options, ReportLanguage};
use tipwatch_analyze::screen::{
    FailureKind, Fleet as Machines, Gathering, Reports, RequestedLogs, Task, TaskResult, Update,
    gather,
};
use tipwatch_binding::MachineFile;

use super::fleet::{Fleet, Notes};
use super::gate::{gate, rules};
use crate::call::error::{Mistake, exception};
use crate::call::options::{Stated, Words, language, value};
use crate::call::place::{Place, paths};

/// The analyses of a fleet with one record per log, for engines that run each log as a task.
#[pyclass(frozen, module = "tipwatch")]
pub(crate) struct FleetTask {
    records: PathBuf,
    /// The fleet file, or the machine file of all logs.
    file: PathBuf,
    machines: Machines,
    options: Options,
    reports: Reports,
    language: ReportLanguage,
    /// Notes of the search for the logs.
    notes: Notes,
    /// Logs that the search found; `None` before the search.
    found: Mutex<Option<RequestedLogs>>,
}

#[pymethods]
impl FleetTask {
    #[new]
    #[pyo3(signature = (
        records, *, machine=None, fleet=None, rate=None, estimator=None, model=None, closed_form_input=None,
        apply_clock_offsets=None, quasi_static=None, accept_inertias=false, reports=None, lang=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
    fn new(
        records: Place,
        machine: Option<Place>,
        fleet: Option<Place>,
        rate: Option<f64>,
        estimator: Option<String>,
        model: Option<String>,
        closed_form_input: Option<String>,
        apply_clock_offsets: Option<String>,
        quasi_static: Option<String>,
        accept_inertias: bool,
        reports: Option<&str>,
        lang: Option<&str>,
    ) -> PyResult<Self> {
        let stated = Stated {
            rate,
            estimator,
            model,
            closed_form_input,
            apply_clock_offsets,
            quasi_static,
            ..Stated::default()
        };
        let read = || {
            let (machines, file) = match (machine, fleet) {
                (Some(file), None) => (Machines::of_one(MachineFile::read(&file)?), file),
                (None, Some(file)) => (Machines::read(&file)?, file),
                _ => bail!(Mistake("expected either machine or fleet".into())),
            };
            Ok(Self {
                records: records.into_path(),
                file: file.into_path(),
                machines: accepting(machines, accept_inertias)?,
                options: stated.options()?,
                reports: value("reports", reports, Reports::default())?,
                language: language(lang)?,
                notes: Notes::default(),
                found: Mutex::default(),
            })
        };
        read().map_err(|error| exception(&error))
    }

    /// Absolute paths of the files that a worker needs besides the logs.
    fn files(&self) -> PyResult<Vec<PathBuf>> {
        let mut files = self.machines.files();
        files.insert(0, self.file.clone());
        let files = files.iter().map(|file| {
            absolute(file).with_context(|| format!("{}: not a valid path", file.display()))
        });
        let mut files: Vec<PathBuf> = files
            .collect::<Result<_, _>>()
            .map_err(|error| exception(&error))?;
        files.sort();
        files.dedup();
        Ok(files)
    }

    /// The logs, each with the estimated memory of its analysis (bytes), the largest first. Of a place that the storage does not
    /// list the failure is recorded.
    fn logs(&self, py: Python<'_>, logs: Vec<Place>) -> PyResult<Vec<(OsString, u64)>> {
        let logs = paths(logs);
        let tell = |told: Update<'_>| self.notes.take(told);
        let searched = py.detach(|| {
            let _speaking = self.language.speak();
            self.task().logs(&logs, &self.machines, &tell)
        });
        let (logs, found) = searched.map_err(|error| exception(&error))?;
        *self.found.lock().unwrap_or_else(PoisonError::into_inner) = Some(found);
        // a path object would not keep the two slashes of a URL
        let logs = logs.into_iter();
        Ok(logs.map(|(log, bytes)| (log.into(), bytes)).collect())
    }

    /// Number of logs that have a record.
    fn records(&self, py: Python<'_>) -> PyResult<usize> {
        let records = py.detach(|| self.task().records());
        records.map_err(|error| exception(&error))
    }

    /// Analyses a log and writes its record; returns kind and reason of its failure, if it failed.
    fn run(&self, py: Python<'_>, log: Place) -> PyResult<Option<(String, String)>> {
        let ran = py.detach(|| {
            let _speaking = self.language.speak();
            self.task().run(&log, &self.machines)
        });
        let TaskResult { failure, .. } = ran.map_err(|error| exception(&error))?;
        Ok(failure.map(|(kind, reason)| (kind.to_string(), reason)))
    }

    /// Writes the failure of a log whose worker could not write one.
    fn fail(&self, py: Python<'_>, log: Place, kind: &str, reason: &str) -> PyResult<()> {
        let fail = || {
            let _speaking = self.language.speak();
            let kind: FailureKind = kind
                .parse()
                .map_err(|_| anyhow!("expected a kind of failure, found \"{kind}\""))?;
            self.task().fail(&log, kind, reason)
        };
        py.detach(fail).map_err(|error| exception(&error))
    }

    /// Builds data set and page; of the logs that were searched for, those without a record are in it as failed.
    fn gather(
        &self,
        py: Python<'_>,
        out: Place,
        min_valid: Option<f64>,
        policy: Option<Place>,
        fail_on: Option<Words>,
        prune: bool,
    ) -> PyResult<Py<Fleet>> {
        let out = out.into_path();
        let policy = rules(policy.as_ref(), fail_on.as_ref()).map_err(|error| exception(&error))?;
        let gathered = py.detach(|| {
            let _speaking = self.language.speak();
            let found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
            let asked = Gathering {
                records: &self.records,
                out: &out,
                logs: &[],
                found: found.as_ref(),
                prune,
                options: self.options,
            };
            gather(&asked, gate(policy.as_ref(), min_valid), &|told| {
                self.notes.take(told);
            })
        });
        let fleet = gathered.and_then(|found| Fleet::of(out, found, self.notes.drain()));
        Fleet::told(py, fleet.map_err(|error| exception(&error))?)
    }
}

/// Machines that accept impossible inertias if that `is_asked`.
///
/// # Errors
/// A machine file says that it does not accept them.
pub(super) fn accepting(machines: Machines, is_asked: bool) -> Result<Machines> {
    match is_asked {
        true => machines.with_machines(|file| Ok(file.accepting_inertias()?)),
        false => Ok(machines),
    }
}

impl FleetTask {
    fn task(&self) -> Task<'_> {
        Task {
            records: &self.records,
            options: self.options,
            reports: self.reports,
        }
    }
}
