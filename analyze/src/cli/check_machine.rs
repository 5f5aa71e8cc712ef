//! `tipwatch check-machine`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tipwatch_binding::MachineFile;

use super::exit::Exit;
use crate::setup::check_machine;

#[derive(Debug, Args)]
pub(super) struct CheckMachineArgs {
    /// The machine file.
    machine: PathBuf,
    /// A log: compute loads in the posture of its first valid row instead of the reference posture.
    #[arg(long)]
    log: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &CheckMachineArgs) -> Result<Exit> {
    let file = MachineFile::read(&args.machine)?;
    let check = check_machine::check(&file, args.log.as_deref())?;
    check_machine::print(&check, args.json)?;
    Ok(Exit::DONE)
}
