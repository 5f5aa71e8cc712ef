//! Comparisons of two analyses, and replays with another motion of the suspension.

use anyhow::{Context, bail};
use pyo3::prelude::*;
use tipwatch_analyze::base::options::{HIGHEST_RATE_HZ, LONGEST_STEP_S};
use tipwatch_analyze::compare::{Side, compare as differences};
use tipwatch_analyze::suspension::{self, SuspensionMode, WhatIfOptions, what_if};

use crate::call::error::{Mistake, exception};
use crate::call::interrupt::{Stop, leavable};
use crate::call::options::{Stated, language, value};
use crate::call::pickle::{Reduced, reduced};
use crate::call::place::Place;
use crate::machine::machine_file;
use crate::table::Table;

/// Compares two logs or output folders of ``analyze``: events, figures, rows.
///
/// Parameters
/// ----------
/// a, b : path
///     A log, or an output folder.
/// machine : Machine or path, optional
///     The machine of the logs.
/// machine_b : Machine or path, optional
///     Another machine for ``b``.
/// rate, estimator, model, lang
///     Those of ``analyze``.
///
/// Returns
/// -------
/// dict
///     The document that ``tipwatch compare --json`` prints; SI units.
///
/// Raises
/// ------
/// TipwatchError
///     A log or folder cannot be read, or a log has no machine.
#[pyfunction]
#[pyo3(signature = (a, b, *, machine=None, machine_b=None, rate=None, estimator=None, model=None, lang=None))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub(crate) fn compare<'py>(
    py: Python<'py>,
    a: Place,
    b: Place,
    machine: Option<&Bound<'py, PyAny>>,
    machine_b: Option<&Bound<'py, PyAny>>,
    rate: Option<f64>,
    estimator: Option<String>,
    model: Option<String>,
    lang: Option<&str>,
) -> PyResult<Bound<'py, PyAny>> {
    let machine_a = machine.map(machine_file).transpose()?;
    let machine_b = machine_b.or(machine).map(machine_file).transpose()?;
    let stated = Stated {
        rate,
        estimator,
        model,
        ..Stated::default()
    };
    let options = stated.options().map_err(|error| exception(&error))?;
    let language = language(lang).map_err(|error| exception(&error))?;
    let compute = move |_: &_| {
        let _speaking = language.speak();
        let a = Side::of(&a, machine_a.as_ref(), options)?;
        let b = Side::of(&b, machine_b.as_ref(), options)?;
        serde_json::to_string(&differences(&a, &b)).context("a comparison")
    };
    let found = leavable(py, compute, |_| Ok(()))?;
    let json = found.map_err(|error| exception(&error))?;
    py.import("json")?.call_method1("loads", (json,))
}

/// A replay of a log with another motion of its suspension.
#[pyclass(frozen, module = "tipwatch")]
pub(crate) struct WhatIf {
    samples: Py<Table>,
    summary: String,
    findings: Vec<String>,
}

#[pymethods]
impl WhatIf {
    /// One row per time (``whatif.parquet``).
    #[getter]
    fn samples(&self, py: Python<'_>) -> Py<Table> {
        self.samples.clone_ref(py)
    }

    /// The summary as a dictionary (``summary.json``).
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (&self.summary,))
    }

    /// What the replay shows, one sentence each.
    #[getter]
    fn findings(&self) -> Vec<String> {
        self.findings.clone()
    }

    /// For pickle.
    fn __reduce__<'py>(this: &Bound<'py, Self>) -> Reduced<'py, (Py<Table>, String, Vec<String>)> {
        let own = this.get();
        let parts = (
            own.samples(this.py()),
            own.summary.clone(),
            own.findings.clone(),
        );
        reduced(this, parts)
    }

    fn __repr__(&self) -> String {
        let first = self.findings.first().map_or("no finding", String::as_str);
        format!(
            "<tipwatch.WhatIf: {first}; {} findings, {} rows>",
            self.findings.len(),
            self.samples.get().__len__()
        )
    }

    #[staticmethod]
    fn _of_parts(samples: Py<Table>, summary: String, findings: Vec<String>) -> Self {
        Self {
            samples,
            summary,
            findings,
        }
    }
}

/// Replays a log with another motion of its active suspension.
///
/// Parameters
/// ----------
/// log : path
///     The log.
/// machine : Machine or path
///     The machine; its machine file describes the suspension.
/// suspension : "look-ahead", "literal", "locked" or "recorded"
///     How the suspension moves.
/// step : float, optional
///     Control period (s); if not given, that of the machine file.
/// rate, start, end, estimator, lang
///     Those of ``analyze``.
/// out : path, optional
///     A folder for the files of ``tipwatch whatif``.
///
/// Returns
/// -------
/// WhatIf
///
/// Raises
/// ------
/// TipwatchError
///     The log cannot be read, the machine does not fit it, or the machine file describes no suspension.
#[pyfunction]
#[pyo3(signature = (
    log, machine, *, suspension=None, step=None, rate=None, start=None, end=None, estimator=None, out=None,
    lang=None
))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub(crate) fn whatif(
    py: Python<'_>,
    log: Place,
    machine: &Bound<'_, PyAny>,
    suspension: Option<String>,
    step: Option<f64>,
    rate: Option<f64>,
    start: Option<f64>,
    end: Option<f64>,
    estimator: Option<String>,
    out: Option<Place>,
    lang: Option<&str>,
) -> PyResult<WhatIf> {
    let file = machine_file(machine)?;
    let language = language(lang).map_err(|error| exception(&error))?;
    let compute = move |stop: &Stop| {
        let _speaking = language.speak();
        let stated = Stated {
            rate,
            start,
            end,
            estimator,
            ..Stated::default()
        };
        let options = stated.options()?;
        let shortest = 1.0 / HIGHEST_RATE_HZ;
        if let Some(step) = step
            && !(shortest..=LONGEST_STEP_S).contains(&step)
        {
            bail!(Mistake(format!(
                "expected a step from {shortest} to {LONGEST_STEP_S} s, found {step}"
            )));
        }
        let motion = WhatIfOptions {
            suspension: value(
                "suspension",
                suspension.as_deref(),
                SuspensionMode::LookAhead,
            )?,
            step_s: step,
        };
        let replay = what_if(&log, &file, options, motion, &mut |_| {})?;
        if let Some(out) = out.as_ref().filter(|_| !stop.is_set()) {
            replay.write(out)?;
        }
        let summary = serde_json::to_string(&suspension::Summary::of(&replay))?;
        let findings = suspension::findings(&replay)
            .iter()
            .map(ToString::to_string)
            .collect();
        anyhow::Ok((suspension::table::table(&replay), summary, findings))
    };
    let found = leavable(py, compute, |_| Ok(()))?;
    let (table, summary, findings) = found.map_err(|error| exception(&error))?;
    Ok(WhatIf {
        samples: Py::new(py, Table::from(table))?,
        summary,
        findings,
    })
}
