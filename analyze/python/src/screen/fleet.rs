//! The result of a screening.

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::{Context, Result};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use tipwatch_analyze::screen::{Screen, query};

use crate::call::error::exception;
use crate::call::pickle::{Reduced, reduced};
use crate::call::place::Place;
use crate::table::Table;

/// The result of a screening: the data set in its folder, and what was counted.
#[pyclass(frozen, module = "tipwatch")]
pub(crate) struct Fleet {
    out: PathBuf,
    totals: String,
    undecided: Vec<(String, String)>,
    page: Option<PathBuf>,
}

impl Fleet {
    pub(super) fn of(out: PathBuf, found: Screen) -> Result<Self> {
        Ok(Self {
            out,
            totals: serde_json::to_string(&found.totals).context("the totals of a screening")?,
            undecided: found.undecided,
            page: found.page,
        })
    }
}

/// What a result of a screening is made of again.
type Parts = (OsString, String, Vec<(String, String)>, Option<OsString>);

#[pymethods]
impl Fleet {
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

    /// The answer to a question in SQL over the tables ``logs``, ``events`` and ``comparisons``, as of ``tipwatch query``.
    fn query(&self, py: Python<'_>, sql: &str) -> PyResult<Table> {
        let answer =
            py.detach(|| query(&self.out, sql).and_then(|answer| Table::of(answer.table()?)));
        answer.map_err(|error| exception(&error))
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

    /// The page (``fleet.html``): a path, or the URL in a bucket; None for one part of a fleet.
    #[getter]
    fn page<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let page = self.page.as_ref().map(|page| match page.to_str() {
            // a path object would not keep the two slashes
            Some(url) if url.contains("://") => url.into_bound_py_any(py),
            _ => page.into_bound_py_any(py),
        });
        page.transpose()
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
        );
        reduced(this, parts)
    }

    #[staticmethod]
    fn _of_parts(
        out: Place,
        totals: String,
        undecided: Vec<(String, String)>,
        page: Option<Place>,
    ) -> Self {
        Self {
            out: out.into_path(),
            totals,
            undecided,
            page: page.map(Place::into_path),
        }
    }

    fn __repr__(&self) -> String {
        format!("<tipwatch.Fleet in {}>", self.out.display())
    }
}
