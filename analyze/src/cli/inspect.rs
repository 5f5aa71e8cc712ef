//! `tipwatch inspect`.

use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use clap::Args;

use super::exit::{Exit, Terminal};
use super::machine_file::InertiaArgs;
use super::open_values;
use crate::base::output_place::OutputPlace;
use crate::base::stdout::to_stdout;
use crate::setup::first_machine::{self, Draft, WriteOptions};
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

/// Writes a first machine file. At a terminal it asks for open values and ends with a first report.
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
    if !open_values::is_asked(terminal) || args.json {
        write(&draft, terminal)?;
        open_values::name(&draft, terminal);
        return Ok(Exit::DONE);
    }
    // answers to many questions must not be lost to a file that is there already
    ensure!(
        !out.exists(),
        "{}: expected a file that does not exist yet, in a writable folder",
        out.display()
    );
    let asked = open_values::ask(&mut draft);
    // what was answered is kept, even if the answers ended early
    let missing = write(&draft, terminal)?;
    asked?;
    if missing.is_some() {
        return Ok(Exit::DONE);
    }
    let file = args.inertias.read(out)?;
    check_machine::print(&check_machine::check(&file, Some(&args.log))?, false)?;
    to_stdout("\n")?;
    open_values::report(&args.log, &file, terminal)
}

/// Writes the machine file; returns the missing inputs, if any.
fn write(draft: &Draft, terminal: Terminal) -> Result<Option<String>> {
    let (out, missing) = first_machine::write(draft)?;
    terminal.print(&format!("machine file: {}", out.display()));
    open_values::tell_missing(missing.as_deref(), terminal);
    Ok(missing)
}
