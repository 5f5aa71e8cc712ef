//! Messages on standard error.

use std::io::{Write, stderr};

/// Writes a line to standard error. Who closes it reads no messages, and still gets the result and the exit code: `eprintln!`
/// would end the program with a panic.
pub(crate) fn to_stderr(text: &str) {
    let _ = writeln!(stderr().lock(), "{text}");
}
