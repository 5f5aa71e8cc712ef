//! `tipwatch-live control`.

use std::process::ExitCode;

use anyhow::Result;
use clap::Args;
use tipwatch_binding::commissioning_of;

use super::arguments::{LoopArgs, MachineArgs, ServiceArgs};
use crate::control::ControlProgram;
use crate::node::{Housekeeping, LiveNode};
use crate::system::clock::Monotonic;
use crate::wire::fingerprint::Fingerprint;

#[derive(Debug, Args)]
pub(super) struct ControlArgs {
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    service: ServiceArgs,
    #[command(flatten)]
    running: LoopArgs,
}

pub(super) fn run_control(args: &ControlArgs) -> Result<ExitCode> {
    let real_time = args.running.real_time()?;
    let file = args.machine.read()?;
    let urdf = file.urdf(args.machine.urdf.as_deref(), None)?;
    // one of another machine, or with contradictions, is refused
    let commissioning = commissioning_of(&file, &urdf)?;
    let bound = commissioning.as_ref().map(|(path, _)| path.as_path());
    let fingerprint = Fingerprint::of_this_program(&file, &urdf, bound)?;
    eprintln!("control: {}", fingerprint.statement());
    let address = args.service.address();
    let node = LiveNode::new(&address, "tipwatch-control")?;
    let options = args.running.options();
    let housekeeping = Housekeeping::start(&address)?;
    let mut control = ControlProgram::new(&node, &file, &urdf, &Monotonic, options)?;
    real_time.apply()?;
    let counts = control.run(&housekeeping)?;
    eprintln!(
        "control: {} rows; samples: {} lost, {} refused, {} repeated",
        counts.rows, counts.lost, counts.refused, counts.repeated
    );
    Ok(ExitCode::SUCCESS)
}
