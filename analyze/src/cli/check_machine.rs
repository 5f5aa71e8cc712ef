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
    /// The URDF, for a machine file that names none; otherwise that of the log is used.
    #[arg(long)]
    urdf: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &CheckMachineArgs) -> Result<Exit> {
    let mut file = MachineFile::read(&args.machine)?;
    if let Some(urdf) = &args.urdf {
        file = file.with_urdf(urdf)?;
    }
    let check = check_machine::check(&file, args.log.as_deref())?;
    check_machine::print(&check, args.json)?;
    Ok(Exit::DONE)
}
