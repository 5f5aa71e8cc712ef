//! `screen`: chooses who runs the analyses.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{anyhow, bail};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tipwatch_analyze::policy::Policy;
use tipwatch_analyze::screen::{
    Fleet as Machines, Gate, Output, Reports, Request, Update, screen as screen_logs,
};
use tipwatch_binding::MachineFile;

use super::fleet::Fleet;
use crate::call::error::{Mistake, exception};
use crate::call::interrupt::{Stop, interruptible};
use crate::call::options::{Stated, value};
use crate::call::place::{Place, paths};
use crate::call::progress::Progress;
use crate::machine::machine_file;

/// Least share of a log's time that must be computable unless a policy states another.
const LEAST_VALID: f64 = 0.5;

/// Analyses many logs on all cores or on a cluster, and builds a data set and a page from them.
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
///     Number of logs analysed in parallel; default: number of processors. With an engine: number of tasks it is given
///     at a time; default: four for each of its processors.
/// rate, estimator, model, closed_form_input, apply_clock_offsets, quasi_static
///     Those of ``analyze``.
/// min_valid : float, optional
///     Least share of a log's time that must be computable for it to decide anything; default: that of the policy, else
///     0.5.
/// policy : path, optional
///     The rules by which the logs are judged (``policy.json``); with threads.
/// prune : bool
///     Remove logs that no longer exist from the data set; with threads.
/// reports : {"events", "all", "none"}, optional
///     Which logs get a report of their own: those with events of wheels or edges (default), all, or none; with threads.
/// memory : float, optional
///     Limit of the estimated memory of all analyses (GiB); default: three quarters of what is free; with threads.
/// progress : bool or callable
///     True shows a bar on standard error (with tqdm or rich, if one of them is installed). A function is called some
///     times a second with the number of finished logs and that of all logs.
/// runner : {"threads", "ray", "dask"}
///     Who runs the analyses: threads of this process, or an engine, with one task per log. Ray is the cluster of
///     ``ray.init`` or ``RAY_ADDRESS``, else one on this machine; Dask that of the current ``distributed.Client``, else
///     one on this machine. Workers need this package and the paths of logs and ``out``; machine files are sent to them.
/// retries : int
///     With an engine: further workers that a log may lose before it is a failure.
///
/// Returns
/// -------
/// Fleet
///
/// Raises
/// ------
/// TipwatchError
///     There is no log, or the folder cannot be used. A log that cannot be analysed is not an error: the data set
///     has it with the reason and its kind; so is a log whose worker is lost.
/// KeyboardInterrupt
///     Ctrl+C, once the logs in work are finished (standard error says so): the data set stays whole, and
///     ``resume=True`` continues.
#[pyfunction]
#[pyo3(signature = (
    logs, *, out, machine=None, fleet=None, resume=false, jobs=None, rate=None, estimator=None, model=None,
    closed_form_input=None, apply_clock_offsets=None, quasi_static=None, min_valid=None, policy=None, prune=false,
    reports=None, memory=None, progress=None, runner="threads", retries=2
))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub(crate) fn screen(
    py: Python<'_>,
    logs: Logs,
    out: Place,
    machine: Option<&Bound<'_, PyAny>>,
    fleet: Option<Place>,
    resume: bool,
    jobs: Option<usize>,
    rate: Option<f64>,
    estimator: Option<String>,
    model: Option<String>,
    closed_form_input: Option<String>,
    apply_clock_offsets: Option<String>,
    quasi_static: Option<String>,
    min_valid: Option<f64>,
    policy: Option<Place>,
    prune: bool,
    reports: Option<&str>,
    memory: Option<f64>,
    progress: Option<Bound<'_, PyAny>>,
    runner: &str,
    retries: u32,
) -> PyResult<Py<Fleet>> {
    if let Some(share) = min_valid
        && !(0.0..=1.0).contains(&share)
    {
        let text = format!("expected min_valid from 0 to 1, found {share}");
        return Err(exception(&anyhow!(Mistake(text))));
    }
    if let Some(gib) = memory
        && !(gib > 0.0)
    {
        let text = format!("expected a positive memory (GiB), found {gib}");
        return Err(exception(&anyhow!(Mistake(text))));
    }
    let machine = machine.map(machine_file).transpose()?;
    let logs = match logs {
        Logs::One(log) => vec![log.into_path()],
        Logs::Several(logs) => paths(logs),
    };
    let out = out.into_path();
    let fleet = fleet.map(Place::into_path);
    let progress = Progress::of(py, progress, "Logs", ())?;
    let stated = Stated {
        rate,
        estimator,
        model,
        closed_form_input,
        apply_clock_offsets,
        quasi_static,
        ..Stated::default()
    };
    if runner != "threads" {
        let of_threads = [
            ("policy", policy.is_some()),
            ("prune", prune),
            ("reports", reports.is_some()),
            ("memory", memory.is_some()),
        ];
        if let Some((name, _)) = of_threads.iter().find(|(_, is_asked)| *is_asked) {
            let text = format!(
                "expected {name} with runner \"threads\" alone, found it with \"{runner}\""
            );
            return Err(exception(&anyhow!(Mistake(text))));
        }
        let arguments = PyDict::new(py);
        // as text: a path object would not keep the two slashes of a URL
        arguments.set_item("out", out.as_os_str())?;
        arguments.set_item("machine", machine.map(as_in_its_file).transpose()?)?;
        arguments.set_item("fleet", fleet)?;
        arguments.set_item("options", stated.keywords(py)?)?;
        arguments.set_item("resume", resume)?;
        arguments.set_item("jobs", jobs)?;
        arguments.set_item("min_valid", min_valid.unwrap_or(LEAST_VALID))?;
        arguments.set_item("retries", retries)?;
        arguments.set_item("tell", progress.function())?;
        let logs: Vec<OsString> = logs.into_iter().map(PathBuf::into_os_string).collect();
        let engines = py.import("tipwatch._engines")?;
        let found = engines.call_method("screen", (runner, logs), Some(&arguments));
        progress.end(found.is_ok())?;
        return Ok(found?.cast_into::<Fleet>()?.unbind());
    }
    let read = || {
        let fleet = match (machine, &fleet) {
            (Some(machine), None) => Machines::of_one(machine),
            (None, Some(fleet)) => Machines::read(fleet)?,
            _ => bail!(Mistake("expected either machine or fleet".into())),
        };
        let policy = policy.as_deref().map(Policy::read).transpose()?;
        let options = stated.options()?;
        let reports = value("reports", reports, Reports::default())?;
        Ok((fleet, options, policy, reports))
    };
    let (fleet, options, policy, reports) =
        read().map_err(|error: anyhow::Error| exception(&error))?;
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
            output: Output::DataSet,
            jobs,
            memory_bytes: memory.map(|gib| (gib * f64::from(1 << 30)) as u64),
            shard: None,
            resume,
            prune,
            reports,
            options,
            stop: Some(stop.flag()),
        };
        let gate = Gate {
            policy: policy.as_ref(),
            min_valid: min_valid
                .or_else(|| policy.as_ref()?.min_valid)
                .unwrap_or(LEAST_VALID),
        };
        screen_logs(&request, &fleet, gate, &notify)
    };
    let found = interruptible(py, compute, |_| {
        progress.tell((done.load(Ordering::Relaxed), all.load(Ordering::Relaxed)))
    });
    progress.end(matches!(found, Ok(Ok(_))))?;
    let found = found?.and_then(|found| Fleet::of(out, found));
    Py::new(py, found.map_err(|error| exception(&error))?)
}

/// The file of a machine, for workers, which read it by themselves.
fn as_in_its_file(machine: MachineFile) -> PyResult<PathBuf> {
    let in_file = MachineFile::read(&machine.path);
    let in_file = in_file.map_err(|error| exception(&anyhow::Error::from(error)))?;
    let is_same = in_file.text == machine.text
        && in_file.spec.urdf == machine.spec.urdf
        && in_file.spec.accept_inertias == machine.spec.accept_inertias;
    match is_same {
        true => Ok(machine.path),
        false => Err(exception(&anyhow!(
            "expected a machine as in its file {}, which workers read; found another text, another URDF or accept_inertias",
            machine.path.display()
        ))),
    }
}

/// One place of logs, or several.
#[derive(FromPyObject)]
pub(crate) enum Logs {
    #[pyo3(transparent)]
    One(Place),
    #[pyo3(transparent)]
    Several(Vec<Place>),
}
