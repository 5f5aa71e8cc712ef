//! Errors as exceptions with the messages of the programs.

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use tipwatch_storage::redact;

create_exception!(
    tipwatch,
    TipwatchError,
    PyException,
    "What tipwatch expected, what it found and where."
);

/// The exception of an error with all its causes.
pub(crate) fn exception(error: &anyhow::Error) -> PyErr {
    // a URL may come from a file, too
    TipwatchError::new_err(redact(&format!("{error:#}")))
}
