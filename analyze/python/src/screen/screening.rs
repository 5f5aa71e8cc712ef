//! `screen`: chooses who runs the analyses.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{Result, anyhow, bail};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};
use tipwatch_analyze::base::options::ReportLanguage;
use tipwatch_analyze::policy::Policy;
use tipwatch_analyze::screen::{
    DEFAULT_ATTEMPTS, Fleet as Machines, Gathering, MOST_JOBS, Output, Reports, Request, Shard,
    Update, gather as gather_records, screen as screen_logs,
};
use tipwatch_binding::MachineFile;

use super::fleet::{Fleet, Notes};
use super::gate::{gate, rules};
use super::task::accepting;
use crate::call::error::{Mistake, exception};
use crate::call::interrupt::{Stop, interruptible};
use crate::call::number::{Whole, positive};
use crate::call::options::{Stated, Words, language, value};
use crate::call::place::{Place, Places};
use crate::call::progress::Progress;
use crate::machine::machine_file;

/// Analyses many logs on all cores or on a cluster, and builds a data set and a page from them.
///
/// Parameters
/// ----------
/// logs : path, or iterable of paths
///     Folders, patterns, manifests and logs. None are needed with ``gather``.
/// out : path
///     Output folder for data set, page and reports; not with ``records``.
/// machine : Machine or path
///     The machine of all logs; or
/// fleet : path
///     the fleet file: rules that assign machine files to logs.
/// accept_inertias : bool
///     Inertias of the URDF that no body can have are replaced, with their uncertainty, instead of refused; as
///     ``accept_inertias = true`` in the machine files.
/// resume : bool
///     Resume the run in the folder: logs already analysed with the same content, machine, options and program are
///     skipped.
/// jobs : int, optional
///     Number of logs analysed in parallel, 1 to 1024; default: number of processors. With an engine: number of tasks it is given
///     at a time; default: four for each of its processors.
/// rate, estimator, model, closed_form_input, apply_clock_offsets, quasi_static
///     Those of ``analyze``.
/// min_valid : float, optional
///     Least share of a log's time that must be computable for it to decide anything; default: that of the policy, else
///     0.5.
/// policy : path, optional
///     The rules by which the logs are judged (``policy.json``).
/// fail_on : str, or iterable of str, optional
///     Kinds of events that no log may have, as "wheel_lift": a policy of these rules. ``Fleet.totals`` counts the logs that
///     break it.
/// prune : bool
///     Remove logs that no longer exist from the data set. With ``gather`` the logs must be named.
/// reports : {"events", "all", "none"}, optional
///     Which logs get a report of their own: those with events of wheels or edges (default), all, or none.
/// memory : float, optional
///     Limit of the estimated memory of all analyses (GiB); default: three quarters of what is free; with threads.
/// shard : str, optional
///     The part of the logs to analyse, as "2/8": the second of eight; ``gather`` combines the parts. "auto/8" takes the
///     index from the variables of Kubernetes, AWS Batch, Slurm, Google Batch or Cloud Run, "auto" the number of parts, too;
///     with threads.
/// records : path, optional
///     Write records and reports alone, into a folder that many processes share, instead of ``out``. Logs that have a
///     record are skipped; ``gather`` makes the data set. With threads.
/// attempts : int, optional
///     With ``records``: number of processes that may be lost while they analyse a log, before it counts as failed;
///     default: 3.
/// gather : bool or path
///     Analyse nothing: build data set and page in ``out`` from the records in this place, or with True from those in
///     ``out``. Of logs that are named, those without a record are in the data set as failed. With threads.
/// lang : {"en", "de"}, optional
///     The language of page, reports and findings; default: English. Keys and columns are English in any. Calls in
///     another language are awaited: a process speaks one at a time.
///     Notes of a :class:`Machine` that is read meanwhile are in that language, too.
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
///     Its ``notes`` are also Python warnings (``UserWarning``).
///
/// Raises
/// ------
/// TipwatchError
///     There is no log, the folder cannot be used, or a keyword has a value that it cannot have or excludes another. A log
///     that cannot be analysed is not an error: the data set has it with the reason and its kind; so is a log whose worker
///     is lost.
/// KeyboardInterrupt
///     Ctrl+C, once the logs in work are finished (standard error says so): the data set stays whole, and
///     ``resume=True`` continues.
#[pyfunction]
#[pyo3(
    signature = (
        logs=Places::default(), *, out=None, machine=None, fleet=None, accept_inertias=false, resume=false,
        jobs=None, rate=None, estimator=None, model=None, closed_form_input=None, apply_clock_offsets=None,
        quasi_static=None, min_valid=None, policy=None, fail_on=None, prune=false, reports=None, memory=None, shard=None,
        records=None, attempts=None, gather=Gather::No, lang=None, progress=None, runner="threads", retries=None
    ),
    text_signature = "(logs=(), *, out=None, machine=None, fleet=None, accept_inertias=False, resume=False, jobs=None, rate=None, estimator=None, model=None, closed_form_input=None, apply_clock_offsets=None, quasi_static=None, min_valid=None, policy=None, fail_on=None, prune=False, reports=None, memory=None, shard=None, records=None, attempts=None, gather=False, lang=None, progress=None, runner='threads', retries=2)"
)]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub(crate) fn screen(
    py: Python<'_>,
    logs: Places,
    out: Option<Place>,
    machine: Option<&Bound<'_, PyAny>>,
    fleet: Option<Place>,
    accept_inertias: bool,
    resume: bool,
    jobs: Option<Whole>,
    rate: Option<f64>,
    estimator: Option<String>,
    model: Option<String>,
    closed_form_input: Option<String>,
    apply_clock_offsets: Option<String>,
    quasi_static: Option<String>,
    min_valid: Option<f64>,
    policy: Option<Place>,
    fail_on: Option<Words>,
    prune: bool,
    reports: Option<&str>,
    memory: Option<f64>,
    shard: Option<&str>,
    records: Option<Place>,
    attempts: Option<Whole>,
    gather: Gather,
    lang: Option<&str>,
    progress: Option<Bound<'_, PyAny>>,
    runner: &str,
    retries: Option<Whole>,
) -> PyResult<Py<Fleet>> {
    let given = [
        ("out", out.is_some()),
        ("machine", machine.is_some()),
        ("fleet", fleet.is_some()),
        ("resume", resume),
        ("jobs", jobs.is_some()),
        ("policy", policy.is_some()),
        ("fail_on", fail_on.is_some()),
        ("prune", prune),
        ("reports", reports.is_some()),
        ("memory", memory.is_some()),
        ("shard", shard.is_some()),
        ("records", records.is_some()),
        ("attempts", attempts.is_some()),
        ("gather", gather.is_asked()),
    ];
    let stated = Stated {
        rate,
        estimator,
        model,
        closed_form_input,
        apply_clock_offsets,
        quasi_static,
        ..Stated::default()
    };
    let checked = || {
        refuse_conflicts(&given, runner)?;
        if gather.is_asked() && prune && logs.0.is_empty() {
            bail!(Mistake(
                "expected the folders or logs of the fleet with prune, found none; without them nobody looks for logs that no \
                 longer exist"
                    .into()
            ));
        }
        if let Some(share) = min_valid
            && !(0.0..=1.0).contains(&share)
        {
            bail!(Mistake(format!(
                "expected min_valid from 0 to 1, found {share}"
            )));
        }
        let number = |name, given: &Option<Whole>, least, most| {
            let given = given.as_ref();
            given
                .map(|given| given.within(name, least..=most))
                .transpose()
        };
        let numbers = Numbers {
            jobs: number("jobs", &jobs, 1, MOST_JOBS)?,
            attempts: number("attempts", &attempts, 1, u32::MAX)?.unwrap_or(DEFAULT_ATTEMPTS),
            retries: number("retries", &retries, 0, u32::MAX)?.unwrap_or(DEFAULT_RETRIES),
            memory_gib: memory
                .map(|gib| positive("memory (GiB)", gib))
                .transpose()?,
        };
        Ok((numbers, language(lang)?))
    };
    let (numbers, language) = checked().map_err(|error| exception(&error))?;
    // before hours of analyses
    let rules = rules(policy.as_ref(), fail_on.as_ref()).map_err(|error| exception(&error))?;
    let progress = Progress::of(py, progress, "Logs", ())?;
    let Places(logs) = logs;
    let call = Call {
        logs,
        out: out.map(Place::into_path),
        machine: machine.map(machine_file).transpose()?,
        fleet: fleet.map(Place::into_path),
        accept_inertias,
        resume,
        prune,
        stated,
        numbers,
        min_valid,
        reports,
        language,
    };
    if runner == "threads" {
        let work = call.work(records, gather, shard);
        let (work, place) = work.map_err(|error| exception(&error))?;
        return call.on_threads(py, &work, place, rules.as_ref(), progress);
    }
    let judged = PyDict::new(py);
    judged.set_item("min_valid", min_valid)?;
    judged.set_item("policy", policy.map(Place::into_path))?;
    judged.set_item("fail_on", fail_on.map(|Words(kinds)| kinds))?;
    judged.set_item("prune", prune)?;
    call.by_engine(py, runner, lang, judged, progress)
}

/// Arguments of a screening, by threads or by an engine.
struct Call<'a> {
    logs: Vec<PathBuf>,
    out: Option<PathBuf>,
    machine: Option<MachineFile>,
    fleet: Option<PathBuf>,
    accept_inertias: bool,
    resume: bool,
    prune: bool,
    stated: Stated,
    numbers: Numbers,
    min_valid: Option<f64>,
    reports: Option<&'a str>,
    language: ReportLanguage,
}

impl Call<'_> {
    /// Screens the logs by workers of an engine.
    fn by_engine(
        self,
        py: Python<'_>,
        runner: &str,
        lang: Option<&str>,
        judged: Bound<'_, PyDict>,
        progress: Progress<'_>,
    ) -> PyResult<Py<Fleet>> {
        let Some(out) = self.out else {
            return Err(exception(&anyhow!(Mistake(
                "expected out, found none".into()
            ))));
        };
        let options = self.stated.keywords(py)?;
        options.set_item("accept_inertias", self.accept_inertias)?;
        options.set_item("reports", self.reports)?;
        options.set_item("lang", lang)?;
        let arguments = PyDict::new(py);
        // as text: a path object would not keep the two slashes of a URL
        arguments.set_item("out", out.into_os_string())?;
        arguments.set_item("machine", self.machine.map(as_in_its_file).transpose()?)?;
        arguments.set_item("fleet", self.fleet)?;
        arguments.set_item("options", options)?;
        arguments.set_item("resume", self.resume)?;
        arguments.set_item("jobs", self.numbers.jobs)?;
        arguments.set_item("judged", judged)?;
        arguments.set_item("retries", self.numbers.retries)?;
        arguments.set_item("tell", progress.function())?;
        let logs: Vec<OsString> = self.logs.into_iter().map(PathBuf::into_os_string).collect();
        let engines = py.import("tipwatch._engines")?;
        let found = engines.call_method("screen", (runner, logs), Some(&arguments));
        progress.end(found.is_ok())?;
        Ok(found?.cast_into::<Fleet>()?.unbind())
    }

    /// Returns the work of the threads of this process, and the place of its results.
    ///
    /// # Errors
    /// A keyword is missing, or its value cannot be used.
    fn work(
        &self,
        records: Option<Place>,
        gather: Gather,
        shard: Option<&str>,
    ) -> Result<(Work, PathBuf)> {
        let (place, output) = match (&self.out, records) {
            (Some(out), None) => (out.clone(), Output::DataSet),
            (None, Some(records)) => {
                let attempts = self.numbers.attempts;
                (records.into_path(), Output::Records { attempts })
            }
            _ => bail!(Mistake("expected either out or records".into())),
        };
        if let Some(records) = gather.records(&place) {
            return Ok((Work::Gather(records), place));
        }
        let machines = match (&self.machine, &self.fleet) {
            (Some(machine), None) => Machines::of_one(machine.clone()),
            (None, Some(fleet)) => Machines::read(fleet)?,
            _ => bail!(Mistake("expected either machine or fleet".into())),
        };
        let work = Work::Analyse {
            machines: accepting(machines, self.accept_inertias)?,
            shard: shard.map(part).transpose()?,
            reports: value("reports", self.reports, Reports::default())?,
            output,
        };
        Ok((work, place))
    }

    /// Screens the logs by the threads of this process.
    fn on_threads(
        &self,
        py: Python<'_>,
        work: &Work,
        place: PathBuf,
        rules: Option<&Policy>,
        progress: Progress<'_>,
    ) -> PyResult<Py<Fleet>> {
        let options = self.stated.options().map_err(|error| exception(&error))?;
        let (done, all) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let notes = Notes::default();
        let notify = |update: Update<'_>| match update {
            Update::Begin(logs) => all.store(logs, Ordering::Relaxed),
            Update::Done { .. } => {
                done.fetch_add(1, Ordering::Relaxed);
            }
            told => notes.take(told),
        };
        let gate = gate(rules, self.min_valid);
        let compute = |stop: &Stop| {
            let _speaking = self.language.speak();
            match work {
                Work::Gather(records) => {
                    let asked = Gathering {
                        records,
                        out: &place,
                        logs: &self.logs,
                        found: None,
                        prune: self.prune,
                        options,
                    };
                    gather_records(&asked, gate, &notify)
                }
                Work::Analyse {
                    machines,
                    shard,
                    reports,
                    output,
                } => {
                    let processors = || std::thread::available_parallelism().map_or(1, usize::from);
                    let memory_bytes =
                        (self.numbers.memory_gib).map(|gib| (gib * f64::from(1 << 30)) as u64);
                    let request = Request {
                        logs: &self.logs,
                        out: &place,
                        output: *output,
                        jobs: (self.numbers.jobs).map_or_else(processors, |jobs| jobs as usize),
                        memory_bytes,
                        shard: *shard,
                        resume: self.resume,
                        prune: self.prune,
                        reports: *reports,
                        options,
                        stop: Some(stop.flag()),
                    };
                    screen_logs(&request, machines, gate, &notify)
                }
            }
        };
        let found = interruptible(py, compute, |_| {
            progress.tell((done.load(Ordering::Relaxed), all.load(Ordering::Relaxed)))
        });
        progress.end(matches!(found, Ok(Ok(_))))?;
        let found = found?.and_then(|found| Fleet::of(place, found, notes.drain()));
        Fleet::told(py, found.map_err(|error| exception(&error))?)
    }
}

/// Further workers of an engine that a log may lose by default.
const DEFAULT_RETRIES: u32 = 2;

/// The numbers of a call, checked.
struct Numbers {
    jobs: Option<u32>,
    attempts: u32,
    retries: u32,
    memory_gib: Option<f64>,
}

/// Work of the threads of this process.
enum Work {
    /// Build the data set from the records in this place.
    Gather(PathBuf),
    Analyse {
        machines: Machines,
        shard: Option<Shard>,
        reports: Reports,
        output: Output,
    },
}

/// Keywords that exclude each other, as the flags of the program do.
const EXCLUSIVE: [(&str, &str); 16] = [
    ("machine", "fleet"),
    ("policy", "fail_on"),
    ("records", "out"),
    ("records", "gather"),
    ("records", "resume"),
    ("records", "prune"),
    ("attempts", "out"),
    ("attempts", "gather"),
    ("shard", "prune"),
    ("gather", "machine"),
    ("gather", "fleet"),
    ("gather", "shard"),
    ("gather", "resume"),
    ("gather", "jobs"),
    ("gather", "memory"),
    ("gather", "reports"),
];

/// Keywords for which an engine has no use.
const OF_THREADS: [&str; 5] = ["memory", "shard", "records", "attempts", "gather"];

/// Keywords, each with whether it was given, that cannot stand together.
///
/// # Errors
/// There are some.
fn refuse_conflicts(given: &[(&str, bool)], runner: &str) -> Result<()> {
    let is_given = |name: &str| given.contains(&(name, true));
    if runner != "threads"
        && let Some(name) = OF_THREADS.iter().find(|name| is_given(name))
    {
        bail!(Mistake(format!(
            "expected {name} with runner \"threads\" alone, found it with {runner:?}"
        )));
    }
    let mut both = EXCLUSIVE.iter();
    match both.find(|(one, other)| is_given(one) && is_given(other)) {
        Some(("machine", "fleet")) => bail!(Mistake(
            "expected either machine or fleet, found both".into()
        )),
        Some((one, other)) => bail!(Mistake(format!(
            "expected {one} without {other}, found both"
        ))),
        None => Ok(()),
    }
}

/// A part of the logs.
fn part(text: &str) -> Result<Shard> {
    let read = Shard::read(text, |name| std::env::var(name).ok());
    read.map_err(|error| anyhow!(Mistake(format!("{error:#}"))))
}

/// The argument `gather`.
pub(crate) enum Gather {
    No,
    /// The records in the output folder.
    FromOut,
    From(Place),
}

impl<'py> FromPyObject<'_, 'py> for Gather {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        Ok(match given.cast::<PyBool>() {
            Ok(wanted) if wanted.is_true() => Self::FromOut,
            Ok(_) => Self::No,
            Err(_) if given.is_none() => Self::No,
            Err(_) => Self::From(given.extract()?),
        })
    }
}

impl Gather {
    fn is_asked(&self) -> bool {
        !matches!(self, Self::No)
    }

    /// The place of the records; `None` if nothing is to be gathered.
    fn records(self, out: &std::path::Path) -> Option<PathBuf> {
        match self {
            Self::No => None,
            Self::FromOut => Some(out.into()),
            Self::From(place) => Some(place.into_path()),
        }
    }
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
