//! `tipwatch inspect`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tipwatch_binding::MachineFile;

use super::Verdict;
use crate::inspect;

#[derive(Debug, Args)]
pub(super) struct InspectArgs {
    /// The log.
    log: PathBuf,
    /// A machine file whose [signals] to bind.
    #[arg(long)]
    machine: Option<PathBuf>,
    /// As JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &InspectArgs) -> Result<Verdict> {
    let file = args.machine.as_deref().map(MachineFile::read).transpose()?;
    let inspection = inspect::inspect(&args.log, file.as_ref())?;
    inspect::print(&inspection, args.json)?;
    Ok(if inspection.losses.is_empty() {
        Verdict::Done
    } else {
        Verdict::Lost
    })
}
