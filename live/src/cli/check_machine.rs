//! `tipwatch-live check-machine`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::Args;
use tipwatch_calibration::commissioning::Status;

use super::arguments::{MachineArgs, ServiceArgs};
use super::exit::{CONTRADICTED, LOST, OPEN};
use crate::node::LiveNode;
use crate::operator::commission;

#[derive(Debug, Args)]
pub(super) struct CheckMachineArgs {
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    service: ServiceArgs,
    /// Write the result to this file, which the key `commissioning` of the machine file binds.
    #[arg(long, value_name = "FILE")]
    commissioning: Option<PathBuf>,
}

pub(super) fn run_check_machine(args: &CheckMachineArgs) -> Result<ExitCode> {
    let file = args.machine.read()?;
    let urdf = file.urdf(args.machine.urdf.as_deref(), None)?;
    let node = LiveNode::new(&args.service.address(), "tipwatch-commission")?;
    let result = commission(&node, &file, &urdf, args.commissioning.as_deref())?;
    let assessment = &result.assessment;
    let mut code = 0;
    if assessment.count(Status::Contradicted) > 0 {
        code += CONTRADICTED;
    }
    if !assessment.is_complete() {
        code += OPEN;
    }
    if code == 0 && result.lost > 0 {
        code = LOST;
    }
    if result.lost > 0 {
        eprintln!("check-machine: {} samples were lost", result.lost);
    }
    Ok(ExitCode::from(code))
}
