//! The result of a screening.

use std::ffi::OsString;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result, anyhow};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use tipwatch_analyze::base::number::count_of;
use tipwatch_analyze::screen::{PAGE, Screen, Update, query, totals_of};

use crate::call::error::{exception, in_python};
use crate::call::pickle::{Reduced, reduced};
use crate::call::place::Place;
use crate::table::{Table, escaped};

/// Notes of a run beside its counts, from all of its threads.
#[derive(Default)]
pub(super) struct Notes(Mutex<Vec<String>>);

impl Notes {
    pub(super) fn take(&self, told: Update<'_>) {
        let note = match told {
            Update::Note(note) => in_python(&note),
            Update::Conflict { reason, .. } => reason.to_owned(),
            Update::Begin(_) | Update::Done { .. } => return,
        };
        let mut notes = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // a conflict is told of each of its logs
        if !notes.contains(&note) {
            notes.push(note);
        }
    }

    /// All of them, once.
    pub(super) fn drain(&self) -> Vec<String> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// A fleet that was screened: the data set in its folder, and what was counted.
///
/// Parameters
/// ----------
/// out : path or URL
///     The folder or bucket of an earlier ``screen``, complete with its page.
///
/// Raises
/// ------
/// TipwatchError
///     There is no data set, or it is not complete.
#[pyclass(frozen, module = "tipwatch")]
pub(crate) struct Fleet {
    out: PathBuf,
    totals: String,
    /// `None` of a data set that was opened: it has them.
    undecided: Option<Vec<(String, String)>>,
    page: Option<PathBuf>,
    notes: Vec<String>,
}

impl Fleet {
    pub(super) fn of(out: PathBuf, found: Screen, notes: Vec<String>) -> Result<Self> {
        Ok(Self {
            out,
            totals: serde_json::to_string(&found.totals).context("the totals of a screening")?,
            undecided: Some(found.undecided),
            page: found.page,
            notes,
        })
    }

    /// Tells the notes as warnings.
    pub(super) fn told(py: Python<'_>, fleet: Self) -> PyResult<Py<Self>> {
        let category = py.get_type::<PyUserWarning>();
        let warn = py.import("warnings")?.getattr("warn")?;
        for note in &fleet.notes {
            warn.call1((note, &category))?;
        }
        Py::new(py, fleet)
    }

    /// Returns the counts of the run as text.
    fn counted(&self) -> String {
        let totals = serde_json::from_str(&self.totals).unwrap_or(serde_json::Value::Null);
        let count = |name: &str| totals[name].as_u64().unwrap_or(0);
        let mut text = format!(
            "{}, {} failed, {} with findings",
            count_of(count("logs") as usize, "log"),
            count("failed"),
            count("with_findings")
        );
        if count("undecided") > 0 {
            // writing to a text does not fail
            let _ = write!(text, ", {} not decided", count("undecided"));
        }
        text
    }
}

/// A path, or a URL as text: a path object would not keep its two slashes.
fn place<'py>(py: Python<'py>, place: &Path) -> PyResult<Bound<'py, PyAny>> {
    match place.to_str() {
        Some(url) if url.contains("://") => url.into_bound_py_any(py),
        _ => place.into_bound_py_any(py),
    }
}

/// Arguments from which pickle rebuilds the result of a screening.
type Parts = (
    OsString,
    String,
    Option<Vec<(String, String)>>,
    Option<OsString>,
    Vec<String>,
);

#[pymethods]
impl Fleet {
    #[new]
    fn new(py: Python<'_>, out: Place) -> PyResult<Self> {
        let totals = py.detach(|| totals_of(&out));
        let out = out.into_path();
        Ok(Self {
            totals: totals.map_err(|error| exception(&error))?,
            undecided: None,
            page: Some(out.join(PAGE)),
            notes: Vec::new(),
            out,
        })
    }

    /// The folder of the data set, or its URL in a bucket.
    #[getter]
    fn out<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        place(py, &self.out)
    }

    /// Pattern of the files with one row per log: ``polars.scan_parquet(fleet.logs_uri)``.
    #[getter]
    fn logs_uri(&self) -> String {
        self.out.join("logs/*.parquet").display().to_string()
    }

    /// Pattern of the files with one row per event.
    #[getter]
    fn events_uri(&self) -> String {
        self.out.join("events/*.parquet").display().to_string()
    }

    /// The rows of all logs.
    #[getter]
    fn logs(&self, py: Python<'_>) -> PyResult<Table> {
        self.query(py, "SELECT * FROM logs")
    }

    /// The rows of all events.
    #[getter]
    fn events(&self, py: Python<'_>) -> PyResult<Table> {
        self.query(py, "SELECT * FROM events")
    }

    /// How the machines compare with their own history and with their type.
    #[getter]
    fn comparisons(&self, py: Python<'_>) -> PyResult<Table> {
        self.query(py, "SELECT * FROM comparisons")
    }

    /// The answer to a question in SQL over the tables ``logs``, ``events`` and ``comparisons``, as of ``tipwatch query``.
    fn query(&self, py: Python<'_>, sql: &str) -> PyResult<Table> {
        let answer =
            py.detach(|| query(&self.out, sql).and_then(|answer| Ok(answer.table()?.into())));
        answer.map_err(|error| exception(&error))
    }

    /// Counts over the whole data set (``screen.json``).
    #[getter]
    fn totals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (&self.totals,))
    }

    /// The logs that decide nothing, each with the reason: by the rules of the run, or of an opened fleet, of the run that wrote
    /// it.
    #[getter]
    fn undecided(&self, py: Python<'_>) -> PyResult<Vec<(String, String)>> {
        if let Some(undecided) = &self.undecided {
            return Ok(undecided.clone());
        }
        let sql = "SELECT path, undecided FROM logs WHERE undecided IS NOT NULL ORDER BY path";
        let answer = py.detach(|| query(&self.out, sql));
        let answer = answer.map_err(|error| exception(&error))?;
        let totals: serde_json::Value = serde_json::from_str(&self.totals).unwrap_or_default();
        if answer.rows() == 0 && totals["undecided"].as_u64() > Some(0) {
            // a data set of before schema 7 has no such column
            let place = self.out.display();
            let reason = anyhow!(
                "{place}: expected the reasons of the logs that decide nothing, found none; gather it anew"
            );
            return Err(exception(&reason));
        }
        let text = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
        let rows = (0..answer.rows()).map(|row| answer.row(row));
        Ok(rows.map(|row| (text(&row[0]), text(&row[1]))).collect())
    }

    /// What the run told beside its counts: logs that were left out, that no longer exist, or that contradict each other. One
    /// sentence each.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    /// The page (``fleet.html``): a path, or the URL in a bucket; None for one part of a fleet.
    #[getter]
    fn page<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.page.as_ref().map(|page| place(py, page)).transpose()
    }

    /// For pickle: the data set stays in its folder.
    fn __reduce__<'py>(this: &Bound<'py, Self>) -> Reduced<'py, Parts> {
        let own = this.get();
        // as text: a path object would not keep the two slashes of a URL
        let parts = (
            own.out.clone().into_os_string(),
            own.totals.clone(),
            own.undecided.clone(),
            own.page.clone().map(PathBuf::into_os_string),
            own.notes.clone(),
        );
        reduced(this, parts)
    }

    #[staticmethod]
    fn _of_parts(
        out: Place,
        totals: String,
        undecided: Option<Vec<(String, String)>>,
        page: Option<Place>,
        notes: Vec<String>,
    ) -> Self {
        Self {
            out: out.into_path(),
            totals,
            undecided,
            page: page.map(Place::into_path),
            notes,
        }
    }

    fn __repr__(&self) -> String {
        format!(
            "<tipwatch.Fleet in {}: {}>",
            self.out.display(),
            self.counted()
        )
    }

    /// The fleet in a notebook: what was counted, and the notes.
    fn _repr_html_(&self) -> String {
        let notes = self.notes.iter();
        let notes = notes.map(|note| format!("<li>{}</li>", escaped(note)));
        let place = escaped(&self.out.display().to_string());
        format!(
            "<p>{} in {place}</p><ul>{}</ul>",
            self.counted(),
            notes.collect::<String>()
        )
    }
}
