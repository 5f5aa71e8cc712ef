//! The command line: what may be asked, and asking it.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Result;
use clap::{Args, Parser, Subcommand};
use tipwatch_binding::MachineFile;

use crate::follow::follow;
use crate::node::{Place, Reader, Writer};
use crate::output::Format;
use crate::recording::Recording;
use crate::replay::{ReplayOptions, Speed, replay};
use crate::topics::DEFAULT_SERVICE;

/// Exit code: a file's content, the machine or the shared memory is at fault.
const FAILED: u8 = 1;
/// Exit code: done, but bytes or messages of a log were lost.
const LOST: u8 = 3;
/// How long a lossless replay waits for its reader unless told, in seconds.
const LOSSLESS_WAIT_S: f64 = 10.0;

/// Wheel loads while the machine works, over shared memory.
#[derive(Debug, Parser)]
#[command(name = "tipwatch-live", version, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Send a log's samples into shared memory, as a machine would.
    Replay(ReplayArgs),
    /// Receive samples and print wheel loads and stability.
    Monitor(MonitorArgs),
}

#[derive(Debug, Args)]
struct Common {
    /// The machine file.
    #[arg(long)]
    machine: PathBuf,
    /// The URDF, where the machine file names none.
    #[arg(long, value_name = "FILE")]
    urdf: Option<PathBuf>,
    /// Name of the services in shared memory.
    #[arg(long, value_name = "NAME", default_value = DEFAULT_SERVICE)]
    service: String,
    /// Prefix of the files of the shared memory: programs with different ones do not see each other.
    #[arg(long, value_name = "NAME")]
    prefix: Option<String>,
}

#[derive(Debug, Args)]
struct ReplayArgs {
    /// The log.
    log: PathBuf,
    #[command(flatten)]
    common: Common,
    /// How many times as fast as recorded, or "max".
    #[arg(long, value_name = "X", default_value = "1", value_parser = speed)]
    speed: Speed,
    /// Wait for readers instead of discarding what they have no room for.
    #[arg(long)]
    lossless: bool,
    /// How long to wait for a reader, in seconds; by default 10 with --lossless, else 0.
    #[arg(long, value_name = "S", value_parser = seconds)]
    wait: Option<Duration>,
}

#[derive(Debug, Args)]
struct MonitorArgs {
    #[command(flatten)]
    common: Common,
    /// Every row as one line of JSON.
    #[arg(long)]
    json: bool,
}

fn speed(text: &str) -> Result<Speed, String> {
    if text == "max" {
        return Ok(Speed::Max);
    }
    match text.parse() {
        Ok(factor) if f64::is_finite(factor) && factor > 0.0 => Ok(Speed::Factor(factor)),
        _ => Err("expected a positive number or \"max\"".into()),
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let number = text
        .parse()
        .ok()
        .and_then(|number| Duration::try_from_secs_f64(number).ok());
    number.ok_or_else(|| "expected a number of seconds, not negative".into())
}

/// Does what the command line asks.
#[must_use]
pub fn run(cli: &Cli) -> ExitCode {
    let result = match &cli.command {
        Command::Replay(args) => run_replay(args),
        Command::Monitor(args) => run_monitor(args),
    };
    result.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::from(FAILED)
    })
}

impl Common {
    fn place(&self) -> Place {
        Place {
            service: self.service.clone(),
            prefix: self.prefix.clone(),
        }
    }
}

fn run_replay(args: &ReplayArgs) -> Result<ExitCode> {
    let file = MachineFile::read(&args.common.machine)?;
    let mut recording = Recording::read(&args.log, &file, args.common.urdf.as_deref())?;
    recording.set_identity();
    let writer = Writer::open(&args.common.place())?;
    let default_wait = if args.lossless { LOSSLESS_WAIT_S } else { 0.0 };
    let options = ReplayOptions {
        speed: args.speed,
        lossless: args.lossless,
        wait: args.wait.unwrap_or(Duration::from_secs_f64(default_wait)),
    };
    let counts = replay(&recording, &writer, options)?;
    eprintln!(
        "replay: {} of {} samples sent, {} found a full queue{}",
        counts.sent,
        recording.session.total_samples,
        counts.discarded,
        if counts.interrupted {
            ", ended by a signal"
        } else {
            ""
        }
    );
    Ok(if recording.losses.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(LOST)
    })
}

fn run_monitor(args: &MonitorArgs) -> Result<ExitCode> {
    let file = MachineFile::read(&args.common.machine)?;
    let urdf = file.urdf(args.common.urdf.as_deref(), None)?;
    let reader = Reader::open(&args.common.place())?;
    let format = if args.json {
        Format::Json
    } else {
        Format::Text
    };
    let counts = follow(&reader, &file, &urdf, format)?;
    eprintln!(
        "monitor: {} rows; samples: {} lost, {} refused, {} repeated, {} sent before joining",
        counts.rows, counts.lost, counts.refused, counts.repeated, counts.before_joining
    );
    Ok(ExitCode::SUCCESS)
}
