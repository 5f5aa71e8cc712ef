//! Whole fleets.

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{Context, bail};
use pyo3::prelude::*;
use tipwatch_analyze::screen::{Fleet as Machines, Gate, Request, Update, screen as screen_logs};

use crate::call::error::exception;
use crate::call::interrupt::{Stop, interruptible};
use crate::call::options::options;
use crate::call::progress::Progress;
use crate::machine::machine_file;

/// The result of a screening: the data set in its folder, and what was counted.
#[pyclass(frozen, module = "tipwatch")]
pub(crate) struct Fleet {
    out: PathBuf,
    totals: String,
    undecided: Vec<(String, String)>,
    page: Option<PathBuf>,
}

#[pymethods]
impl Fleet {
    /// Pattern of the files with one row per log: ``polars.scan_parquet(fleet.logs_uri)``.
    #[getter]
    fn logs_uri(&self) -> String {
        self.out.join("logs/**/*.parquet").display().to_string()
    }

    /// Pattern of the files with one row per event.
    #[getter]
    fn events_uri(&self) -> String {
        self.out.join("events/**/*.parquet").display().to_string()
    }

    /// Counts over the whole data set (``screen.json``).
    #[getter]
    fn totals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (&self.totals,))
    }

    /// The logs that decide nothing, each with the reason.
    #[getter]
    fn undecided(&self) -> Vec<(String, String)> {
        self.undecided.clone()
    }

    /// The page (``fleet.html``); None for one part of a fleet.
    #[getter]
    fn page(&self) -> Option<PathBuf> {
        self.page.clone()
    }

    fn __repr__(&self) -> String {
        format!("<tipwatch.Fleet in {}>", self.out.display())
    }
}

/// Analyses many logs on all cores, and builds a data set and a page from them.
///
/// Parameters
/// ----------
/// logs : path, or sequence of paths
///     Folders, patterns, manifests and logs.
/// out : path
///     Output folder for data set, page and reports.
/// machine : Machine or path
///     The machine of all logs; or
/// fleet : path
///     the fleet file: rules that assign machine files to logs.
/// resume : bool
///     Resume the run in the folder: logs already analysed with the same content, machine, options and program are
///     skipped.
/// jobs : int, optional
///     Number of logs analysed in parallel; default: number of processors.
/// rate, estimator, model
///     Those of ``analyze``.
/// min_valid : float
///     Least share of a log's time that must be computable for it to decide anything.
/// progress : bool or callable
///     True shows a bar on standard error (with tqdm or rich, if one of them is installed). A function is called some
///     times a second with the number of finished logs and that of all logs.
///
/// Returns
/// -------
/// Fleet
///
/// Raises
/// ------
/// TipwatchError
///     There is no log, or the folder cannot be used. A log that cannot be analysed is not an error: the data set
///     has it with the reason.
/// KeyboardInterrupt
///     Ctrl+C, once the logs in work are finished: the data set stays whole, and ``resume=True`` continues.
#[pyfunction]
#[pyo3(signature = (
    logs, *, out, machine=None, fleet=None, resume=false, jobs=None, rate=None, estimator=None, model=None,
    min_valid=0.5, progress=None
))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub(crate) fn screen(
    py: Python<'_>,
    logs: Logs,
    out: PathBuf,
    machine: Option<&Bound<'_, PyAny>>,
    fleet: Option<PathBuf>,
    resume: bool,
    jobs: Option<usize>,
    rate: Option<f64>,
    estimator: Option<&str>,
    model: Option<&str>,
    min_valid: f64,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Fleet> {
    let machine = machine.map(machine_file).transpose()?;
    let read = || {
        if !(0.0..=1.0).contains(&min_valid) {
            bail!("expected min_valid from 0 to 1, found {min_valid}");
        }
        let fleet = match (machine, &fleet) {
            (Some(machine), None) => Machines::of_one(machine),
            (None, Some(fleet)) => Machines::read(fleet)?,
            _ => bail!("expected either machine or fleet"),
        };
        Ok((fleet, options(rate, None, None, estimator, model)?))
    };
    let (fleet, options) = read().map_err(|error: anyhow::Error| exception(&error))?;
    let logs = match logs {
        Logs::One(log) => vec![log],
        Logs::Several(logs) => logs,
    };
    let processors = || std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = jobs.unwrap_or_else(processors).max(1);
    let (done, all) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let notify = |update: Update<'_>| match update {
        Update::Begin(logs) => all.store(logs, Ordering::Relaxed),
        Update::Done { .. } => {
            done.fetch_add(1, Ordering::Relaxed);
        }
        Update::Note(_) => {}
    };
    let compute = |stop: &Stop| {
        let request = Request {
            logs: &logs,
            out: &out,
            jobs,
            memory_bytes: None,
            shard: None,
            resume,
            options,
            stop: Some(stop.flag()),
        };
        let gate = Gate {
            policy: None,
            min_valid,
        };
        screen_logs(&request, &fleet, gate, &notify)
    };
    let progress = Progress::of(py, progress, "Logs", ())?;
    let found = interruptible(py, compute, |_| {
        progress.tell((done.load(Ordering::Relaxed), all.load(Ordering::Relaxed)))
    });
    progress.end(matches!(found, Ok(Ok(_))))?;
    let found = found?.map_err(|error| exception(&error))?;
    let totals = serde_json::to_string(&found.totals).context("the totals of a screening");
    Ok(Fleet {
        out,
        totals: totals.map_err(|error| exception(&error))?,
        undecided: found.undecided,
        page: found.page,
    })
}

/// One place of logs, or several.
#[derive(FromPyObject)]
pub(crate) enum Logs {
    #[pyo3(transparent)]
    One(PathBuf),
    #[pyo3(transparent)]
    Several(Vec<PathBuf>),
}
