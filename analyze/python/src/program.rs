//! The command-line program inside the package.

use std::process::ExitCode;

use clap::Parser;
use pyo3::prelude::*;
use tipwatch_analyze::cli;

/// Runs the program `tipwatch` with these arguments, the first of which is its name.
///
/// Returns
/// -------
/// int
///     The exit code.
#[pyfunction]
pub(crate) fn main(py: Python<'_>, arguments: Vec<String>) -> PyResult<u8> {
    let arguments = tipwatch_storage::without_secrets(arguments.into_iter().map(Into::into));
    let cli = match cli::Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => {
            error.print()?;
            return Ok(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    Ok(code(py.detach(|| cli::run(&cli))))
}

/// The number behind an exit code, which the standard library only hands to the system.
fn code(code: ExitCode) -> u8 {
    (0..=u8::MAX)
        .find(|&number| ExitCode::from(number) == code)
        .unwrap_or(1)
}
