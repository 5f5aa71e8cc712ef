//! Errors as exceptions with the messages of the programs.

use std::io;

use polars::prelude::PolarsError;
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use tipwatch_analyze::base::error_text::error_text;
use tipwatch_analyze::base::storage_error::{log_error, storage_error};
use tipwatch_analyze::screen::NotAnswered;
use tipwatch_binding::{BindError, MachineFileError};
use tipwatch_ingest::Error as LogError;
use tipwatch_mechanics::MachineError;
use tipwatch_storage::ErrorKind;

create_exception!(
    tipwatch,
    TipwatchError,
    PyException,
    "What tipwatch expected, what it found and where. `kind` is \"not_found\", \"exists\", \"permission\", \"storage\", \
     \"value\", \"log\" (not a log), \"machine\" (no valid machine, or none of this log), \"query\" (SQL that has no answer), \
     \"package\" (one that is not installed) or \"error\". The first is also a FileNotFoundError, the second a FileExistsError, the \
     third a PermissionError, \"package\" an ImportError; \"value\", \"log\", \"machine\" and \"query\" are also a ValueError."
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
    let text = in_python(&error_text(error));
    Python::attach(|py| of_kind(py, kind_of(error), &text))
}

/// The exception of an error of polars.
pub(crate) fn of_polars(error: PolarsError) -> PyErr {
    exception(&error.into())
}

/// The exception of a kind.
pub(crate) fn of_kind(py: Python<'_>, kind: &str, text: &str) -> PyErr {
    let made = py
        .import("tipwatch._errors")
        .and_then(|errors| errors.call_method1("error", (kind, text)));
    made.map_or_else(
        |_| TipwatchError::new_err(text.to_owned()),
        PyErr::from_value,
    )
}

/// Flags of the program that are keywords in Python, with the text for messages there. Longer ones come before their beginnings.
const KEYWORDS: [(&str, &str); 27] = [
    ("--estimator smoother", "estimator=\"smoother\""),
    ("--model whole-body", "model=\"whole-body\""),
    (
        "--apply-clock-offsets estimated",
        "apply_clock_offsets=\"estimated\"",
    ),
    ("--estimator", "estimator"),
    ("--model", "model"),
    ("--machine-b", "machine_b"),
    ("--machine", "machine"),
    ("--fleet", "fleet"),
    ("--out", "out"),
    ("--records", "records"),
    ("--attempts", "attempts"),
    ("--shard", "shard"),
    ("--gather", "gather"),
    ("--fail-on", "fail_on"),
    ("--accept-inertias", "accept_inertias=True"),
    ("--resume", "resume=True"),
    ("--prune", "prune=True"),
    ("--rate", "rate"),
    ("--from", "start"),
    ("--to", "end"),
    ("--widen-sigmas", "widen_sigmas"),
    ("--time-column", "set_read_options(time_column=...)"),
    ("--time-unit", "set_read_options(time_unit=...)"),
    ("--date-order", "set_read_options(date_order=...)"),
    ("--no-header", "set_read_options(header=False)"),
    ("--definitions", "set_read_options(definitions=...)"),
    ("--fetch-whole", "set_read_options(fetch_whole=True)"),
];

/// A text of the program with the keywords of Python in place of its flags, where they are words: in a path they stay.
pub(crate) fn in_python(text: &str) -> String {
    KEYWORDS
        .iter()
        .fold(text.to_owned(), |text, (flag, keyword)| {
            let mut parts = text.split(flag);
            let mut written = parts.next().unwrap_or_default().to_owned();
            for part in parts {
                let begins = written
                    .chars()
                    .next_back()
                    .is_none_or(|c| c.is_whitespace() || "\"'`([".contains(c));
                let mut next = part.chars();
                let ends = match next.next() {
                    // the end of a sentence, and not of a file's name
                    Some('.') => next.next().is_none_or(char::is_whitespace),
                    Some(c) => c.is_whitespace() || "\"'`)],;:=".contains(c),
                    None => true,
                };
                written.push_str(if begins && ends { keyword } else { flag });
                written.push_str(part);
            }
            written
        })
}

/// Returns the kind of an error, by which programs tell errors apart.
fn kind_of(error: &anyhow::Error) -> &'static str {
    let of_cause = |cause: &(dyn std::error::Error + 'static)| {
        if cause.is::<Mistake>() {
            return Some("value");
        }
        if cause.is::<NotAnswered>() {
            return Some("query");
        }
        let error = cause.downcast_ref::<io::Error>()?;
        match error.kind() {
            io::ErrorKind::NotFound => Some("not_found"),
            io::ErrorKind::PermissionDenied => Some("permission"),
            io::ErrorKind::AlreadyExists => Some("exists"),
            // what a call asks for; the system says it of other things
            io::ErrorKind::InvalidInput if error.raw_os_error().is_none() => Some("value"),
            _ => None,
        }
    };
    let is_of_machine = |cause: &(dyn std::error::Error + 'static)| {
        cause.is::<MachineFileError>() || cause.is::<BindError>() || cause.is::<MachineError>()
    };
    let of_machine = || error.chain().any(is_of_machine).then_some("machine");
    let of_storage = storage_error(error).and_then(|error| match error.kind {
        ErrorKind::NotAPlace => Some("value"),
        ErrorKind::NotFound => Some("not_found"),
        ErrorKind::PermissionDenied => Some("permission"),
        ErrorKind::TimedOut
        | ErrorKind::Unavailable
        | ErrorKind::Incomplete
        | ErrorKind::Refused => Some("storage"),
        _ => None,
    });
    let of_log = || match log_error(error)? {
        LogError::NotALog { .. } | LogError::Unsupported { .. } | LogError::Table { .. } => {
            Some("log")
        }
        _ => None,
    };
    let of_causes = || error.chain().find_map(of_cause);
    of_storage
        .or_else(of_log)
        .or_else(of_causes)
        .or_else(of_machine)
        .unwrap_or("error")
}
