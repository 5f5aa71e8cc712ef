//! Progress of a call: to a function of the caller, or as a bar (`analyze/python/tipwatch/_progress.py`).

use pyo3::IntoPyObjectExt;
use pyo3::call::PyCallArgs;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyBool;

/// Receiver of the progress of a call.
pub(crate) enum Progress<'py> {
    /// Nobody.
    Silent,
    /// A function of the caller.
    Function(Bound<'py, PyAny>),
    /// A bar of the package.
    Bar(Bound<'py, PyAny>),
}

impl<'py> Progress<'py> {
    /// The argument `progress` of a call; `bar` names the bar's class in `tipwatch._progress`.
    ///
    /// # Errors
    /// The argument is neither a truth value nor callable.
    pub(crate) fn of(
        py: Python<'py>,
        progress: Option<Bound<'py, PyAny>>,
        bar: &str,
        arguments: impl PyCallArgs<'py>,
    ) -> PyResult<Self> {
        let Some(progress) = progress else {
            return Ok(Self::Silent);
        };
        if let Ok(wanted) = progress.cast::<PyBool>() {
            return match wanted.is_true() {
                true => {
                    let class = py.import("tipwatch._progress")?.getattr(bar)?;
                    Ok(Self::Bar(class.call1(arguments)?))
                }
                false => Ok(Self::Silent),
            };
        }
        match progress.is_callable() {
            true => Ok(Self::Function(progress)),
            false => Err(PyTypeError::new_err(format!(
                "expected progress True, False or a function, found {}",
                progress.repr()?
            ))),
        }
    }

    /// Tells how far the call is.
    pub(crate) fn tell(&self, arguments: impl PyCallArgs<'py>) -> PyResult<()> {
        match self {
            Self::Silent => Ok(()),
            Self::Function(function) | Self::Bar(function) => function.call1(arguments).map(drop),
        }
    }

    /// Returns the function or the bar that takes the progress, for callers in Python; `None` if nothing is shown.
    pub(crate) fn function(&self) -> Option<&Bound<'py, PyAny>> {
        match self {
            Self::Silent => None,
            Self::Function(function) | Self::Bar(function) => Some(function),
        }
    }

    /// Ends a bar; it is full if the call `is_done`.
    pub(crate) fn end(&self, is_done: bool) -> PyResult<()> {
        match self {
            Self::Silent | Self::Function(_) => Ok(()),
            Self::Bar(bar) => {
                let is_done = is_done.into_py_any(bar.py())?;
                bar.call_method1("end", (is_done,)).map(drop)
            }
        }
    }
}
