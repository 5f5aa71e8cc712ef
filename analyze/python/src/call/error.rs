//! Errors as exceptions with the messages of the programs.

use std::io;

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use tipwatch_analyze::base::storage_error::storage_error;
use tipwatch_storage::{ErrorKind, redact};

create_exception!(
    tipwatch,
    TipwatchError,
    PyException,
    "What tipwatch expected, what it found and where. `kind` is \"not_found\", \"permission\", \"storage\", \"value\" or \
     \"error\"; those of the first, second and fourth kind are also a FileNotFoundError, PermissionError or ValueError."
);

/// An argument with a value that it cannot have.
#[derive(Debug)]
pub(crate) struct Mistake(pub(crate) String);

impl std::fmt::Display for Mistake {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Mistake {}

/// The exception of an error with all its causes.
pub(crate) fn exception(error: &anyhow::Error) -> PyErr {
    // a URL may come from a file, too
    let text = redact(&format!("{error:#}"));
    Python::attach(|py| {
        let arguments = (kind_of(error), text.as_str());
        let made = py
            .import("tipwatch._errors")
            .and_then(|errors| errors.call_method1("error", arguments));
        made.map_or_else(|_| TipwatchError::new_err(text.clone()), PyErr::from_value)
    })
}

/// What programs tell errors apart by.
fn kind_of(error: &anyhow::Error) -> &'static str {
    let of_cause = |cause: &(dyn std::error::Error + 'static)| {
        if cause.is::<Mistake>() {
            return Some("value");
        }
        let of_file = || match cause.downcast_ref::<io::Error>()?.kind() {
            io::ErrorKind::NotFound => Some("not_found"),
            io::ErrorKind::PermissionDenied => Some("permission"),
            _ => None,
        };
        of_file()
    };
    let of_storage = storage_error(error).and_then(|error| match error.kind {
        ErrorKind::NotFound => Some("not_found"),
        ErrorKind::PermissionDenied => Some("permission"),
        ErrorKind::TimedOut
        | ErrorKind::Unavailable
        | ErrorKind::Incomplete
        | ErrorKind::Refused => Some("storage"),
        _ => None,
    });
    let of_causes = || error.chain().find_map(of_cause);
    of_storage.or_else(of_causes).unwrap_or("error")
}
