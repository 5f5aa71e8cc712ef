//! Fixtures, the program under test, and what it printed.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Options;
use tipwatch_binding::MachineFile;

/// A fixture of the repository.
pub(crate) fn data(name: &str) -> PathBuf {
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = crate_folder.join("../tests/data").canonicalize();
    folder.unwrap().join(name)
}

/// A log beside the repository, for ignored tests.
pub(crate) fn shared(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/logs");
    let path = path.join(name);
    assert!(path.exists(), "expected {}, found none", path.display());
    path
}

pub(crate) fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

pub(crate) fn command(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tipwatch"));
    command.args(args);
    command
}

/// Runs the program.
pub(crate) fn tipwatch(args: &[&str]) -> Output {
    command(args).output().unwrap()
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

pub(crate) fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Runs a Python script, with `TIPWATCH_PYTHON` or else `python3`; its messages say what is missing.
pub(crate) fn run_python(arguments: &[&str]) {
    let python = std::env::var("TIPWATCH_PYTHON").unwrap_or("python3".into());
    let output = Command::new(&python).args(arguments).output();
    let output = output.unwrap_or_else(|error| panic!("{python}: {error}"));
    let messages = stdout(&output) + &stderr(&output);
    assert!(
        output.status.success(),
        "{python} {arguments:?}: {messages}"
    );
}

/// Exit code and standard error.
pub(crate) fn code_and_stderr(output: &Output) -> (i32, String) {
    (output.status.code().unwrap(), stderr(output))
}

/// Analyses a log with default options.
pub(crate) fn analysed(log: &Path, machine: &Path) -> Analysis {
    let file = MachineFile::read(machine).unwrap();
    analyse(log, &file, Options::default(), &mut |_| {}).unwrap()
}
