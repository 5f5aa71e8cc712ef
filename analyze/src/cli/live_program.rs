//! The program `tipwatch-live`: found beside this one or in the search path, and run in its place.

use std::process::Command;

use tipwatch_binding::program_beside;

const NAME: &str = "tipwatch-live";

/// Returns a command of the live program.
pub(super) fn command(name: &str) -> Command {
    let mut command = Command::new(program_beside(NAME));
    command.arg(name);
    command
}

/// Replaces this program by it; returns only with the error why that cannot be done.
pub(super) fn run_instead(mut command: Command) -> anyhow::Error {
    let error = replace_by(&mut command);
    error.context(format!(
        "{}: cannot be started; --live needs {NAME} beside this program or in the search path",
        command.get_program().display()
    ))
}

#[cfg(unix)]
fn replace_by(command: &mut Command) -> anyhow::Error {
    use std::os::unix::process::CommandExt;
    command.exec().into()
}

#[cfg(not(unix))]
fn replace_by(command: &mut Command) -> anyhow::Error {
    match command.status() {
        Ok(status) => std::process::exit(status.code().unwrap_or(1)),
        Err(error) => error.into(),
    }
}
