//! Analyses of whole logs.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use anyhow::{Result, bail};
use pyo3::prelude::*;
use tipwatch_analyze::analysis::run::{Prepared, RowSink, analyse_into};
use tipwatch_analyze::base::options::{
    MOST_DRAWS, MoreColumns, Options, Precision, ReportLanguage,
};
use tipwatch_analyze::base::output_place::OutputPlace;
use tipwatch_analyze::base::rows::Rows;
use tipwatch_analyze::events::Event;
use tipwatch_analyze::load::MeasuredLoads;
use tipwatch_analyze::output::{self, OutputOptions, Sinks};
use tipwatch_analyze::report;
use tipwatch_analyze::tables::summary::Summary;
use tipwatch_analyze::tables::{events, samples, studies};
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine;

use crate::call::error::{Mistake, exception};
use crate::call::interrupt::{Stop, leavable};
use crate::call::number::Whole;
use crate::call::options::{Stated, Words, language};
use crate::call::pickle::{Reduced, reduced};
use crate::call::place::{Place, paths};
use crate::call::progress::Progress;
use crate::machine::machine_file;
use crate::table::{Chunks, Table, escaped, no_column, once};

/// The analysis of one log: tables, findings, summary.
#[pyclass(frozen, module = "tipwatch")]
pub(crate) struct Analysis(Found<Py<Table>>);

/// Results of an analysis, with tables of the interpreter or without it.
struct Found<T> {
    samples: T,
    events: T,
    sensitivity: Option<T>,
    summary: String,
    notes: Vec<String>,
    valid_share: Option<f64>,
    files: Vec<PathBuf>,
}

/// Arguments from which pickle rebuilds an analysis.
type Parts = (
    Py<Table>,
    Py<Table>,
    Option<Py<Table>>,
    String,
    Vec<String>,
    Option<f64>,
    Vec<PathBuf>,
);

#[pymethods]
impl Analysis {
    /// One row per time: loads, margins, indicators, causes, standard deviations (``samples.parquet``).
    #[getter]
    fn samples(&self, py: Python<'_>) -> Py<Table> {
        self.0.samples.clone_ref(py)
    }

    /// One row per event (``events.parquet``).
    #[getter]
    fn events(&self, py: Python<'_>) -> Py<Table> {
        self.0.events.clone_ref(py)
    }

    /// What the loads depend on most (``sensitivity.parquet``); None for models without derivatives.
    #[getter]
    fn sensitivity(&self, py: Python<'_>) -> Option<Py<Table>> {
        self.0.sensitivity.as_ref().map(|table| table.clone_ref(py))
    }

    /// The summary as a dictionary (``summary.json``).
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (&self.0.summary,))
    }

    /// Assumptions, missing signals, anomalies: one sentence each.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.0.notes.clone()
    }

    /// Share of the log's time that could be computed, 0 to 1; None for a log without duration.
    #[getter]
    fn valid_share(&self) -> Option<f64> {
        self.0.valid_share
    }

    /// The files that were written into ``out``.
    #[getter]
    fn files(&self) -> Vec<PathBuf> {
        self.0.files.clone()
    }

    /// Draws the log with matplotlib: the load of each wheel with its band of two standard deviations, margins of zero
    /// moment point and utilisation, and the events as shaded times. Samples need the columns ``time_ns``, ``valid``, and
    /// ``load_WHEEL`` and ``load_WHEEL_sigma`` of the wheels to draw; ``utilisation`` and ``zmp_margin`` are drawn if they
    /// are there.
    ///
    /// Parameters
    /// ----------
    /// start, end : float, optional
    ///     Time range (seconds after the first row).
    /// ax : pair of matplotlib axes, optional
    ///     Where to draw loads and margins; a new figure if not given.
    ///
    /// Returns
    /// -------
    /// matplotlib.figure.Figure
    ///     The figure; its ``axes`` are those of loads and margins. Of given axes it is theirs.
    ///
    /// Raises
    /// ------
    /// TipwatchError
    ///     Samples lack a column (``columns`` of ``analyze``), or there is no row between ``start`` and ``end``.
    /// ImportError
    ///     matplotlib is not installed.
    #[pyo3(signature = (start=None, end=None, ax=None))]
    fn plot<'py>(
        this: &Bound<'py, Self>,
        start: Option<f64>,
        end: Option<f64>,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let drawing = this.py().import("tipwatch._drawing")?;
        drawing.call_method1("plot", (this, start, end, ax))
    }

    /// For pickle: tables, summary and notes travel; files stay where they are.
    fn __reduce__<'py>(this: &Bound<'py, Self>) -> Reduced<'py, Parts> {
        let (py, own) = (this.py(), this.get());
        let parts = (
            own.samples(py),
            own.events(py),
            own.sensitivity(py),
            own.0.summary.clone(),
            own.0.notes.clone(),
            own.0.valid_share,
            own.0.files.clone(),
        );
        reduced(this, parts)
    }

    #[staticmethod]
    fn _of_parts(
        samples: Py<Table>,
        events: Py<Table>,
        sensitivity: Option<Py<Table>>,
        summary: String,
        notes: Vec<String>,
        valid_share: Option<f64>,
        files: Vec<Place>,
    ) -> Self {
        Self(Found {
            samples,
            events,
            sensitivity,
            summary,
            notes,
            valid_share,
            files: paths(files),
        })
    }

    fn __repr__(&self) -> String {
        let findings = self.findings();
        let more = match findings.len() {
            0 | 1 => String::new(),
            count => format!(" (and {} more findings)", count - 1),
        };
        let first = findings.first().map_or("no finding", String::as_str);
        format!(
            "<tipwatch.Analysis: {first}{more}; {} notes, {} files>",
            self.0.notes.len(),
            self.0.files.len()
        )
    }

    /// The analysis in a notebook: its findings.
    fn _repr_html_(&self) -> String {
        let findings = self.findings().into_iter();
        let items: String = findings
            .map(|finding| format!("<li>{}</li>", escaped(&finding)))
            .collect();
        format!(
            "<ul>{items}</ul><p>{} rows, {} notes, {} files</p>",
            self.0.samples.get().__len__(),
            self.0.notes.len(),
            self.0.files.len()
        )
    }
}

impl Analysis {
    /// The first sentence of each finding.
    fn findings(&self) -> Vec<String> {
        let summary: serde_json::Value = serde_json::from_str(&self.0.summary).unwrap_or_default();
        let findings = summary["findings"].as_array().into_iter().flatten();
        let texts = findings.filter_map(serde_json::Value::as_str);
        texts.map(ToOwned::to_owned).collect()
    }
}

/// Takes the rows of an analysis as tables, and for files where these are wanted.
struct Collector<'a> {
    machine: machine::Machine,
    measured_loads: Arc<MeasuredLoads>,
    precision: Precision,
    samples: Chunks,
    sinks: Option<Sinks>,
    stop: &'a Stop,
}

impl RowSink for Collector<'_> {
    fn take(&mut self, rows: &Arc<Rows>) -> Result<()> {
        if self.stop.is_set() {
            bail!("interrupted");
        }
        let block = samples::samples(&self.machine, rows, self.precision, &self.measured_loads);
        self.samples.take(&block)?;
        match &mut self.sinks {
            Some(sinks) => sinks.take(rows),
            None => Ok(()),
        }
    }

    fn settle(&mut self, row: usize, time_ns: Option<i64>, events: &[Event]) -> Result<()> {
        match &mut self.sinks {
            Some(sinks) => sinks.settle(row, time_ns, events),
            None => Ok(()),
        }
    }
}

/// Arguments of an analysis.
struct Request {
    log: PathBuf,
    options: Options,
    precision: Precision,
    /// The columns of samples that are kept; all if `None`.
    columns: Option<Vec<String>>,
    out: Option<PathBuf>,
    language: ReportLanguage,
}

/// Prefixes of the columns that only a log with measured loads has.
const MEASURED: [&str; 2] = ["load_measured_", "load_residual_"];

/// Refuses names of columns that no log of the machine has, before one is read. Of a machine whose URDF is in the log nothing is
/// known before.
fn check_columns(file: &MachineFile, request: &Request) -> Result<()> {
    let Some(columns) = &request.columns else {
        return Ok(());
    };
    once(columns).map_err(Mistake)?;
    let Ok(machine) = file.check_alone() else {
        return Ok(());
    };
    // of supports that come and go the log tells which there are
    if machine.supports().vary() {
        return Ok(());
    }
    let known = samples::columns(&machine, &request.options);
    let is_measured = |name: &str| MEASURED.iter().any(|start| name.starts_with(start));
    let is_unknown = |name: &&String| !known.contains(name) && !is_measured(name);
    match columns.iter().find(is_unknown) {
        Some(name) => bail!(Mistake(no_column(known.iter().map(String::as_str), name))),
        None => Ok(()),
    }
}

fn run(
    request: &Request,
    file: &MachineFile,
    bytes: &AtomicU64,
    stop: &Stop,
) -> Result<Found<Table>> {
    let _speaking = request.language.speak();
    let target = request
        .out
        .as_deref()
        .map(OutputPlace::folder)
        .transpose()?;
    let local = target.as_ref().map(OutputPlace::path);
    let begin = |prepared: &Prepared<'_>| {
        let output = OutputOptions {
            precision: request.precision,
            ..OutputOptions::default()
        };
        // what the steps before kept is not what the rows need
        tipwatch_allocator::give_back();
        Ok(Collector {
            machine: prepared.machine.clone(),
            measured_loads: Arc::clone(prepared.measured_loads),
            precision: request.precision,
            samples: Chunks::of(request.columns.clone()),
            sinks: local
                .map(|out| Sinks::begin(prepared, out, output))
                .transpose()?,
            stop,
        })
    };
    let mut progress = |read: u64| bytes.store(read, Ordering::Relaxed);
    let (analysis, collector) =
        analyse_into(&request.log, file, request.options, &mut progress, begin)?;
    let Collector { samples, sinks, .. } = collector;
    if stop.is_set() {
        bail!("interrupted");
    }
    let files = match (sinks, target, &request.out) {
        (Some(sinks), Some(target), Some(out)) => {
            let written = output::finish(&analysis, sinks, target.path())?;
            target.publish(output::SUMMARY)?;
            written.files.iter().map(|name| out.join(name)).collect()
        }
        _ => Vec::new(),
    };
    let events = events::events(&analysis.events).into();
    let sensitivity = studies::sensitivity(&analysis);
    let sensitivity = sensitivity.map(Table::from);
    let summary = Summary::of(&analysis, report::main_findings(&analysis));
    let summary = serde_json::to_string(&summary)?;
    let notes = analysis.notes.iter().map(ToString::to_string).collect();
    let valid_share = analysis.coverage.valid_share;
    // the samples of a long log need the memory that the analysis has
    drop(analysis);
    tipwatch_allocator::give_back();
    Ok(Found {
        samples: samples.finish()?,
        events,
        sensitivity,
        summary,
        notes,
        valid_share,
        files,
    })
}

/// Analyses one log: loads, margins, events and their causes, as ``tipwatch analyze`` does.
///
/// Parameters
/// ----------
/// log : path or URL
///     The log; also in a bucket or on a web server (``"s3://logs/shift.mcap"``, ``gs://``, ``az://``, ``https://``).
///     Credentials come from the environment.
/// machine : Machine or path
///     The machine, or its machine file.
/// out : path or URL, optional
///     A folder for the files of ``tipwatch analyze``: tables, summary, report, derived log.
/// rate : float, optional
///     Rows per second; if not given, rows follow the fastest joint stream.
/// start, end : float, optional
///     Time range (seconds after the first sample).
/// estimator : "smoother" or "causal"
///     The smoother uses future samples and is the most accurate; "causal" gives the bits of live operation.
/// model : "whole-body", "variable-inertia" or "closed-form"
///     The model of the ground wrench.
/// closed_form_input : "velocity" or "accelerometer"
///     Where the closed forms take the platform's acceleration from; if not given, from odometry where the log has it.
/// apply_clock_offsets : "stated" or "estimated"
///     Which offsets between the clocks of topics are corrected; if not given, those that the machine file states.
/// quasi_static : "auto", "always" or "never"
///     Whether rows of a sparse log are static; if not given, as the machine file says, else "auto".
/// monte_carlo : int, optional
///     Number of machines (1 to 10000) with lengths, angles, masses and inertias varied by up to 10 %, for the bands of
///     their loads in the summary.
/// parts : bool
///     Whether samples have the contribution of every link.
/// terms : bool
///     Whether samples have the terms of the closed forms, and speed and direction of wheels and axles.
/// precision : 32 or 64
///     Bits of the computed numbers in samples and files: 32 are about seven digits.
/// columns : str, or iterable of str, optional
///     The columns that samples keep, in this order; all if not given. An hour with all of them takes
///     200 MB, almost twice as much with 64 bits. Files in ``out`` have all.
/// lang : {"en", "de"}, optional
///     The language of report and findings; default: English. Keys and columns are English in any. Calls in another
///     language are awaited: a process speaks one at a time.
///     Notes of a :class:`Machine` that is read meanwhile are in that language, too.
/// progress : bool or callable
///     True shows a bar on standard error (with tqdm or rich, if one of them is installed). A function is called some
///     times a second with the number of bytes read so far.
///
/// Returns
/// -------
/// Analysis
///
/// Raises
/// ------
/// TipwatchError
///     The log cannot be read, the machine does not fit it, no row remains, or samples have no such column.
/// KeyboardInterrupt
///     Ctrl+C. Files in ``out`` may be incomplete.
#[pyfunction]
#[pyo3(signature = (
    log, machine, *, out=None, rate=None, start=None, end=None, estimator=None, model=None, closed_form_input=None,
    apply_clock_offsets=None, quasi_static=None, monte_carlo=None, parts=false, terms=false, precision=32, columns=None,
    lang=None, progress=None
))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub(crate) fn analyze(
    py: Python<'_>,
    log: Place,
    machine: &Bound<'_, PyAny>,
    out: Option<Place>,
    rate: Option<f64>,
    start: Option<f64>,
    end: Option<f64>,
    estimator: Option<String>,
    model: Option<String>,
    closed_form_input: Option<String>,
    apply_clock_offsets: Option<String>,
    quasi_static: Option<String>,
    monte_carlo: Option<Whole>,
    parts: bool,
    terms: bool,
    precision: i64,
    columns: Option<Words>,
    lang: Option<&str>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Analysis> {
    let file = machine_file(machine)?;
    let request = || {
        let draws = monte_carlo.map(|draws| draws.within("monte_carlo", 1..=MOST_DRAWS));
        let draws = draws.transpose()?;
        let stated = Stated {
            rate,
            start,
            end,
            estimator,
            model,
            closed_form_input,
            apply_clock_offsets,
            quasi_static,
        };
        Ok(Request {
            log: log.into_path(),
            options: Options {
                columns: MoreColumns { parts, terms },
                monte_carlo: draws.map(|draws| draws as usize),
                ..stated.options()?
            },
            precision: match precision {
                32 => Precision::Single,
                64 => Precision::Double,
                _ => bail!(Mistake(format!(
                    "expected precision 32 or 64, found {precision}"
                ))),
            },
            columns: columns.map(|Words(names)| names),
            out: out.map(Place::into_path),
            language: language(lang)?,
        })
    };
    let request = request().map_err(|error| exception(&error))?;
    check_columns(&file, &request).map_err(|error| exception(&error))?;
    let progress = Progress::of(py, progress, "Log", (request.log.as_os_str(),))?;
    let bytes = Arc::new(AtomicU64::new(0));
    let read = Arc::clone(&bytes);
    let mut last = 0;
    let found = leavable(
        py,
        move |stop| run(&request, &file, &read, stop),
        |_| {
            let read = bytes.load(Ordering::Relaxed);
            match std::mem::replace(&mut last, read) == read {
                true => Ok(()),
                false => progress.tell((read,)),
            }
        },
    );
    progress.end(matches!(found, Ok(Ok(_))))?;
    let found = found?.map_err(|error| exception(&error))?;
    Ok(Analysis(Found {
        samples: Py::new(py, found.samples)?,
        events: Py::new(py, found.events)?,
        sensitivity: (found.sensitivity)
            .map(|table| Py::new(py, table))
            .transpose()?,
        summary: found.summary,
        notes: found.notes,
        valid_share: found.valid_share,
        files: found.files,
    }))
}
