//! Results on standard output.

use std::io::{ErrorKind, Write, stdout};

use anyhow::{Context, Result};
use serde::Serialize;

/// Writes a text to standard output. A closed pipe (such as `head`) is not an error.
///
/// # Errors
/// Standard output cannot be written for any other reason.
pub(crate) fn to_stdout(text: &str) -> Result<()> {
    let mut out = stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(error).context("standard output: cannot be written")
        }
        _ => Ok(()),
    }
}

/// Prints a document as JSON or as text.
///
/// # Errors
/// Standard output cannot be written.
pub(crate) fn print<T: Serialize>(
    document: &T,
    as_json: bool,
    as_text: impl FnOnce(&T) -> Result<String, std::fmt::Error>,
) -> Result<()> {
    match as_json {
        true => to_stdout(&format!("{}\n", serde_json::to_string_pretty(document)?)),
        false => to_stdout(&as_text(document)?),
    }
}
