//! `tipwatch inspect`.

use std::io::{IsTerminal, stderr, stdin};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;

use super::exit::{Exit, Terminal};
use super::first_report;
use super::machine_file::InertiaArgs;
use crate::base::output_place::OutputPlace;
use crate::base::stdout::to_stdout;
use crate::setup::first_machine::{self, Draft, OpenValues, WriteOptions};
use crate::setup::inspect::Described;
use crate::setup::{check_machine, inspect};

#[derive(Debug, Args)]
pub(super) struct InspectArgs {
    /// The log.
    log: PathBuf,
    /// A machine file whose [signals] are bound.
    #[arg(long)]
    machine: Option<PathBuf>,
    #[command(flatten)]
    inertias: InertiaArgs,
    /// A DBC file that describes the messages of CAN buses; may be given several times.
    #[arg(long, value_name = "FILE")]
    dbc: Vec<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Write a first machine file, guessed and commented; an existing file is never overwritten. At a terminal, what moves
    /// the loads of this log most is asked for, and a first report is written to NAME-results/ beside NAME.toml.
    #[arg(long, value_name = "FILE")]
    write_machine: Option<PathBuf>,
    /// The URDF to guess from, if the log contains none.
    #[arg(long, requires = "write_machine")]
    urdf: Option<PathBuf>,
    /// With --write-machine: hold joints still that no message measures, such as passive cylinders; each is written with
    /// the mass that it carries.
    #[arg(long, requires = "write_machine")]
    freeze_passive: bool,
}

pub(super) fn run(args: &InspectArgs, terminal: Terminal) -> Result<Exit> {
    if let Some(out) = &args.write_machine {
        OutputPlace::require_local(out)?;
    }
    let file = args
        .machine
        .as_deref()
        .map(|path| args.inertias.read(path))
        .transpose()?;
    let databases = inspect::read_databases(&args.dbc, file.as_ref())?;
    let inspection = inspect::inspect(&args.log, file.as_ref(), &databases)?;
    inspect::print(&inspection, args.json)?;
    let exit = match inspection.losses.is_empty() {
        true => Exit::DONE,
        false => Exit::LOST,
    };
    match &args.write_machine {
        Some(out) => Ok(exit.and(write_machine(args, out, &databases, terminal)?)),
        None => Ok(exit),
    }
}

/// Writes a first machine file. At a terminal it asks for what is open and ends with a first report.
fn write_machine(
    args: &InspectArgs,
    out: &Path,
    databases: &[Described],
    terminal: Terminal,
) -> Result<Exit> {
    let options = WriteOptions {
        accepts_inertias: args.inertias.accept_inertias,
        freezes_passive: args.freeze_passive,
    };
    let mut draft = first_machine::draft(&args.log, args.urdf.as_deref(), out, databases, options)?;
    let asks = stdin().is_terminal() && stderr().is_terminal() && !terminal.quiet && !args.json;
    if !asks {
        write(&draft, terminal)?;
        let open = first_machine::open_values(&draft);
        name_open_values(&open, terminal);
        return Ok(Exit::DONE);
    }
    refuse_existing(out)?;
    let asked = first_machine::ask(&mut draft, &mut stdin().lock(), &mut stderr());
    // what was answered is kept, even if the answers ended early
    let missing = write(&draft, terminal)?;
    asked.context("the terminal")?;
    match missing {
        Some(_) => Ok(Exit::DONE),
        None => report(args, out, terminal),
    }
}

/// Answers to many questions must not be lost to a file that is there already.
fn refuse_existing(out: &Path) -> Result<()> {
    ensure!(
        !out.exists(),
        "{}: expected a file that does not exist yet, in a writable folder",
        out.display()
    );
    Ok(())
}

/// Writes the machine file; returns what is still missing, if anything.
fn write(draft: &Draft, terminal: Terminal) -> Result<Option<String>> {
    let (out, missing) = first_machine::write(draft)?;
    terminal.print(&format!("machine file: {}", out.display()));
    if let Some(missing) = &missing {
        terminal.print(&format!("the machine file is incomplete: {missing}"));
    }
    Ok(missing)
}

/// Where nobody can be asked: one line with the keys that a person would be asked for, in the same order.
fn name_open_values(open: &OpenValues, terminal: Terminal) {
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

/// Checks the machine file that was written, and writes a first report beside it.
fn report(args: &InspectArgs, out: &Path, terminal: Terminal) -> Result<Exit> {
    let file = args.inertias.read(out)?;
    check_machine::print(&check_machine::check(&file, Some(&args.log))?, false)?;
    to_stdout("\n")?;
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    let results = out.with_file_name(format!("{stem}-results"));
    let next = format!(
        "tipwatch analyze {} --machine {} --out {}",
        args.log.display(),
        out.display(),
        results.display()
    );
    let ending = first_report::write(&args.log, &file, &results, &next, terminal)?;
    Ok(ending.tell(terminal))
}
