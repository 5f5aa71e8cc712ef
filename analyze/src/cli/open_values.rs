//! Open values of a new machine file: asked for at a terminal, named elsewhere; and the first report with the answers.

use std::io::{IsTerminal, stderr, stdin};
use std::path::Path;

use anyhow::{Context, Result};
use tipwatch_binding::MachineFile;

use super::exit::{Exit, Terminal};
use super::first_report;
use crate::setup::first_machine::{self, Draft};

/// Whether a person at the terminal can be asked.
pub(super) fn is_asked(terminal: Terminal) -> bool {
    stdin().is_terminal() && stderr().is_terminal() && !terminal.quiet
}

/// Asks at the terminal.
pub(super) fn ask(draft: &mut Draft) -> Result<()> {
    first_machine::ask(draft, &mut stdin().lock(), &mut stderr()).context("the terminal")
}

/// Prints the inputs that the log lacks for an analysis.
pub(super) fn tell_missing(missing: Option<&str>, terminal: Terminal) {
    if let Some(missing) = missing {
        terminal.print(&format!("the machine file is incomplete: {missing}"));
    }
}

/// Prints the keys of the questions in one line, in their order, where nobody can be asked.
pub(super) fn name(draft: &Draft, terminal: Terminal) {
    let open = first_machine::open_values(draft);
    let keys: Vec<&str> = open.values.iter().map(|value| value.key.as_str()).collect();
    if keys.is_empty() {
        return;
    }
    let order = match open.unranked {
        None => "what moves the loads of this log most first",
        Some(_) => "in no order, because the loads cannot be computed yet",
    };
    terminal.print(&format!(
        "open or assumed, {order}: {}; set these keys in the machine file, or run this command at a terminal to be asked",
        keys.join(", ")
    ));
}

/// Writes a first report beside the machine file.
pub(super) fn report(log: &Path, file: &MachineFile, terminal: Terminal) -> Result<Exit> {
    let stem = file.path.file_stem().unwrap_or_default().to_string_lossy();
    let results = file.path.with_file_name(format!("{stem}-results"));
    let next = format!(
        "tipwatch analyze {} --machine {} --out {}",
        log.display(),
        file.path.display(),
        results.display()
    );
    let ending = first_report::write(log, file, &results, &next, terminal)?;
    Ok(ending.tell(terminal))
}
