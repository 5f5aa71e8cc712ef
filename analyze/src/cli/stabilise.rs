//! `tipwatch stabilise`.

use std::io::{stdin, stdout};

use anyhow::Result;
use clap::Args;
use tipwatch_mechanics::machine::ControlMode;

use super::exit::Exit;
use super::machine_file::MachineFileArgs;
use super::options::period;
use crate::suspension::stabilise;

#[derive(Debug, Args)]
pub(super) struct StabiliseArgs {
    #[command(flatten)]
    machine: MachineFileArgs,
    /// The optimisation problem; default: that of the machine file.
    #[arg(long, value_enum)]
    mode: Option<Mode>,
    /// Control period; default: from the rate in the machine file.
    #[arg(long, value_name = "S", value_parser = period)]
    step: Option<f64>,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Mode {
    /// The problem of the second paper, one step ahead.
    Literal,
    /// Optimisation over a planned motion.
    LookAhead,
}

pub(super) fn run(args: &StabiliseArgs) -> Result<Exit> {
    let file = args.machine.read()?;
    let mode = args.mode.map(|mode| match mode {
        Mode::Literal => ControlMode::OneStep,
        Mode::LookAhead => ControlMode::LookAhead,
    });
    stabilise::serve(&file, mode, args.step, stdin().lock(), stdout().lock())?;
    Ok(Exit::DONE)
}
