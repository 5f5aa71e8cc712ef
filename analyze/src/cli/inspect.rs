//! `tipwatch inspect`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::exit::{Exit, Terminal};
use super::machine_file::InertiaArgs;
use crate::base::output_place::OutputPlace;
use crate::setup::first_machine::{self, WriteOptions};
use crate::setup::inspect;

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
    /// Write a first machine file, guessed and commented; an existing file is never overwritten.
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
    if let Some(out) = &args.write_machine {
        let missing = first_machine::write(
            &args.log,
            args.urdf.as_deref(),
            out,
            &databases,
            WriteOptions {
                accepts_inertias: args.inertias.accept_inertias,
                freezes_passive: args.freeze_passive,
            },
        )?;
        terminal.print(&format!("machine file: {}", out.display()));
        if let Some(missing) = missing {
            terminal.print(&format!("the machine file is incomplete: {missing}"));
        }
    }
    Ok(if inspection.losses.is_empty() {
        Exit::DONE
    } else {
        Exit::LOST
    })
}
