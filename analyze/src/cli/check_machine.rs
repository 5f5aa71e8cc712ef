//! `tipwatch check-machine`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use tipwatch_calibration::commissioning::{Assessment, Status};

use super::exit::{Exit, Terminal, Usage};
use super::live_program;
use super::machine_file::{InertiaArgs, MachineArg};
use crate::base::output_place::OutputPlace;
use crate::base::stdout::to_stdout;
use crate::setup::check_machine::MachineCheck;
use crate::setup::{check_machine, commissioning};

#[derive(Debug, Args)]
pub(super) struct CheckMachineArgs {
    #[command(flatten)]
    machine: MachineArg,
    #[command(flatten)]
    inertias: InertiaArgs,
    /// A log: compute loads in the posture of its first valid row instead of the reference posture, and show
    /// what it proves of signs, axes, order, scale and mounting of the sensors. Exit code 4 if it contradicts
    /// the machine file, 8 if it leaves an item open.
    #[arg(long)]
    log: Option<PathBuf>,
    /// The URDF, for a machine file that names none; otherwise that of the log is used.
    #[arg(long)]
    urdf: Option<PathBuf>,
    /// Commission the machine: write the result to this file, which the key `commissioning` of the machine file
    /// binds.
    #[arg(long, value_name = "FILE")]
    commissioning: Option<PathBuf>,
    /// Guide a person through the commissioning, with live samples from shared memory; runs `tipwatch-live
    /// check-machine`.
    #[arg(long, conflicts_with_all = ["log", "json"])]
    live: bool,
    /// With --live: name of the services in shared memory.
    #[arg(long, value_name = "NAME", requires = "live")]
    service: Option<String>,
    /// With --live: prefix of all files in shared memory.
    #[arg(long, value_name = "NAME", requires = "live")]
    prefix: Option<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &CheckMachineArgs, terminal: Terminal) -> Result<Exit> {
    if let Some(out) = &args.commissioning {
        OutputPlace::require_local(out)?;
    }
    if args.live {
        return Err(run_live(args)?);
    }
    let file = (args.inertias).read_with_urdf(args.machine.path()?, args.urdf.as_deref())?;
    let check = check_machine::check(&file, args.log.as_deref());
    let Some(log) = &args.log else {
        if args.commissioning.is_some() {
            return Err(Usage("--commissioning: expected --log LOG or --live as well").into());
        }
        let check = check?;
        check_machine::print(&check, args.json)?;
        return Ok(exit_of_weighings(&check));
    };
    // A log that fits no posture may still show what is wrong.
    let commissioned = commissioning::from_log(log, &file)?;
    if let Some(path) = &args.commissioning {
        write(path, &commissioned.file.to_json())?;
    }
    let exit = exit_of(&commissioned.assessment);
    let exit = Exit {
        lost: commissioned.has_losses && args.commissioning.is_some(),
        ..exit
    };
    let text = &commissioned.text;
    match check {
        Ok(check) => {
            let exit = exit.and(exit_of_weighings(&check));
            let check = check.with_commissioning(&commissioned.file, commissioned.unused_limits);
            check_machine::print(&check, args.json)?;
            if !args.json {
                to_stdout(&format!("\n{text}"))?;
            }
            Ok(exit)
        }
        Err(error) => {
            to_stdout(text)?;
            terminal.error(&error);
            Ok(exit.and(Exit::FAILED))
        }
    }
}

/// Weighings that contradict each other break a rule; where they contradict the machine, either may be wrong.
fn exit_of_weighings(check: &MachineCheck) -> Exit {
    Exit {
        broken: check.is_contradicted(),
        undecided: check.leaves_a_weighing_open(),
        ..Exit::DONE
    }
}

/// Returns the exit: contradictions break a rule; items that are neither proven nor confirmed are undecided.
fn exit_of(assessment: &Assessment) -> Exit {
    Exit {
        broken: assessment.count(Status::Contradicted) > 0,
        undecided: !assessment.is_complete(),
        ..Exit::DONE
    }
}

fn write(path: &Path, text: &str) -> Result<()> {
    std::fs::write(path, text).with_context(|| format!("{}: cannot be written", path.display()))
}

/// Replaces this program by `tipwatch-live check-machine`; returns only with the error why it cannot.
fn run_live(args: &CheckMachineArgs) -> Result<anyhow::Error> {
    let mut command = live_program::command("check-machine");
    command.arg("--machine").arg(args.machine.path()?);
    if args.inertias.accept_inertias {
        command.arg("--accept-inertias");
    }
    let paths = [
        ("--urdf", &args.urdf),
        ("--commissioning", &args.commissioning),
    ];
    for (option, path) in paths {
        command.args(
            path.iter()
                .flat_map(|path| [Path::new(option), path.as_path()]),
        );
    }
    for (option, name) in [("--service", &args.service), ("--prefix", &args.prefix)] {
        command.args(name.iter().flat_map(|name| [option, name.as_str()]));
    }
    Ok(live_program::run_instead(command))
}
