//! Asks one question until its answer can be read.

use std::io::{BufRead, Result, Write};

/// Asks until `read` takes the answer, which may be empty; after a refused answer it prints the expected one.
///
/// # Errors
/// The terminal cannot be read or written, or the answers end early.
pub fn prompt<T>(
    text: &str,
    read: impl Fn(&str) -> std::result::Result<T, String>,
    input: &mut dyn BufRead,
    output: &mut dyn Write,
) -> Result<T> {
    loop {
        write!(output, "{text}: ")?;
        output.flush()?;
        match read(&line(input)?) {
            Ok(answer) => return Ok(answer),
            Err(refusal) => writeln!(output, "{refusal}")?,
        }
    }
}

/// Reads one line, and returns it without the line break.
fn line(input: &mut dyn BufRead) -> Result<String> {
    let mut text = String::new();
    if input.read_line(&mut text)? == 0 {
        return Err(std::io::Error::new(
            std::io::ErrorKind::UnexpectedEof,
            "expected an answer, found the end of the input",
        ));
    }
    Ok(text.trim().to_owned())
}

/// Returns the message about an answer that cannot be read.
#[must_use]
pub fn refusal(expected: &str, found: &str) -> String {
    format!("Expected {expected}, found \"{found}\".")
}

/// The parts of an answer that is a list.
pub fn parts(text: &str) -> impl Iterator<Item = &str> {
    text.split([',', ';']).map(str::trim)
}
