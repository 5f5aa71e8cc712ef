//! The command line: one file per command.

mod arguments;
mod bridge;
mod check_machine;
mod control;
mod exit;
mod monitor;
mod operator;
mod play;
mod record;
mod rehearse;
mod replay;

use std::io::Write;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};
use tipwatch_storage::redact;

use arguments::MachineArgs;
use bridge::{BridgeArgs, DbcArgs, print_dbc, print_msg, run_bridge};
use check_machine::{CheckMachineArgs, run_check_machine};
use control::{ControlArgs, run_control};
use exit::FAILED;
use monitor::{MonitorArgs, run_monitor};
use operator::{AcknowledgeArgs, WatchArgs, run_acknowledge, run_watch};
use play::{PlayArgs, run_play};
use record::{RecordArgs, run_record};
use rehearse::{RehearseArgs, run_rehearse};
use replay::{ReplayArgs, run_replay};

use crate::wire::c_header::c_header;

/// Live wheel loads and stability alarms, over shared memory.
#[derive(Debug, Parser)]
#[command(name = "tipwatch-live", version, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Send the samples of a log to shared memory, as a machine would.
    Replay(ReplayArgs),
    /// Replay a log to a monitor and a recorder, with a display, all in this terminal, and analyse what was recorded.
    Rehearse(RehearseArgs),
    /// Receive samples and publish verdicts: how close the machine is to tipping.
    Monitor(MonitorArgs),
    /// Receive samples and verdicts and control the active suspension.
    Control(ControlArgs),
    /// Record samples, verdicts and commands in MCAP files.
    Record(RecordArgs),
    /// Show loads, margins and the verdict in the terminal.
    Watch(WatchArgs),
    /// Acknowledge the monitor's alarm, or trust a signal again that failed visibly.
    Acknowledge(AcknowledgeArgs),
    /// Commission the machine: guide a person through a drive that proves signs, axes, order, scale and mounting of its
    /// sensors. The same as `tipwatch check-machine --live`.
    CheckMachine(CheckMachineArgs),
    /// Bridge messages of ROS 2 and frames of CAN to the services in shared memory: the topics and signals that the
    /// machine file binds become samples.
    Bridge(Box<BridgeArgs>),
    /// Publish the messages of a log in their own time, as `ros2 bag play` does, or its CAN frames.
    Play(PlayArgs),
    /// Print the DBC file of the verdict's CAN frame.
    Dbc(DbcArgs),
    /// Print the definition of the verdict message (tipwatch_msgs/msg/Verdict) for this machine.
    Msg(MachineArgs),
    /// Print the C header of the messages in shared memory.
    Header,
}

/// Runs the command.
#[must_use]
pub fn run(cli: &Cli) -> ExitCode {
    let result = match &cli.command {
        Command::Replay(args) => run_replay(args),
        Command::Rehearse(args) => run_rehearse(args),
        Command::Monitor(args) => run_monitor(args),
        Command::Control(args) => run_control(args),
        Command::Record(args) => run_record(args),
        Command::Watch(args) => run_watch(args),
        Command::Acknowledge(args) => run_acknowledge(args),
        Command::CheckMachine(args) => run_check_machine(args),
        Command::Bridge(args) => run_bridge(args),
        Command::Play(args) => run_play(args),
        Command::Dbc(args) => print_dbc(args),
        Command::Msg(args) => print_msg(args),
        Command::Header => print_header(),
    };
    result.unwrap_or_else(|error| {
        // a URL may come from a file, too
        eprintln!("error: {}", redact(&format!("{error:#}")));
        ExitCode::from(FAILED)
    })
}

fn print_header() -> Result<ExitCode> {
    std::io::stdout().write_all(c_header().as_bytes())?;
    Ok(ExitCode::SUCCESS)
}
