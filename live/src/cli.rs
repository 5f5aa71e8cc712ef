//! The command line: what may be asked, and asking it.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Result, bail};
use clap::{Args, Parser, Subcommand};
use tipwatch_binding::MachineFile;

use crate::control::ControlProgram;
use crate::monitor::MonitorProgram;
use crate::monitor::ProgramObserver;
use crate::monitor::output::Format;
use crate::node::Wake;
use crate::node::{Housekeeping, LoopOptions};
use crate::node::{LiveNode, ServiceAddress};
use crate::operator::acknowledge;
use crate::operator::watch;
use crate::record::{RecordOptions, record};
use crate::replay::Recording;
use crate::replay::{ReplayOptions, Speed, replay};
use crate::system::clock::Monotonic;
use crate::system::realtime::RealTime;
use crate::wire::c_header::c_header;
use crate::wire::topics::DEFAULT_SERVICE;

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
    /// Receive samples, tell how near the machine is to tipping.
    Monitor(MonitorArgs),
    /// Receive samples and verdicts, steer the active suspension.
    Control(ControlArgs),
    /// Write samples, verdicts and commands to MCAP files.
    Record(RecordArgs),
    /// Show loads, margins and verdict on the terminal.
    Watch(WatchArgs),
    /// Tell the monitor that its alarm was seen.
    Acknowledge(PlaceArgs),
    /// Print the C header of the messages in shared memory.
    Header,
}

#[derive(Debug, Args)]
struct MachineArgs {
    /// The machine file.
    #[arg(long)]
    machine: PathBuf,
    /// The URDF, where the machine file names none.
    #[arg(long, value_name = "FILE")]
    urdf: Option<PathBuf>,
}

#[derive(Debug, Args)]
struct PlaceArgs {
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
    machine: MachineArgs,
    #[command(flatten)]
    place: PlaceArgs,
    /// How many times as fast as recorded, or "max".
    #[arg(long, value_name = "X", default_value = "1", value_parser = speed)]
    speed: Speed,
    /// Wait for readers instead of overwriting what they have not read.
    #[arg(long)]
    lossless: bool,
    /// How many readers to wait for before the first sample.
    #[arg(long, value_name = "N", default_value_t = 1)]
    readers: usize,
    /// How long to wait for them, in seconds; by default 10 with --lossless, else 0.
    #[arg(long, value_name = "S", value_parser = seconds)]
    wait: Option<Duration>,
}

#[derive(Debug, Args)]
struct MonitorArgs {
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    place: PlaceArgs,
    /// Every row as one line of JSON.
    #[arg(long, conflicts_with = "quiet")]
    json: bool,
    /// Print nothing: verdicts go to shared memory only.
    #[arg(long, short)]
    quiet: bool,
    #[command(flatten)]
    running: LoopArgs,
}

#[derive(Debug, Args)]
struct ControlArgs {
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    place: PlaceArgs,
    #[command(flatten)]
    running: LoopArgs,
}

#[derive(Debug, Args)]
struct LoopArgs {
    /// Wait for the next session when one is over.
    #[arg(long)]
    stay: bool,
    /// How to wait for samples: "poll" (fastest, takes a processor), "event", or microseconds to sleep.
    #[arg(long, default_value = "event")]
    wake: Wake,
    /// Keep all memory in RAM.
    #[arg(long)]
    lock_memory: bool,
    /// The processor to run on.
    #[arg(long, value_name = "N")]
    core: Option<usize>,
    /// Real-time priority under SCHED_FIFO, 1 to 99; not with --wake poll.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(i32).range(1..=99))]
    priority: Option<i32>,
}

#[derive(Debug, Args)]
struct RecordArgs {
    /// The folder for the files; it is made if it is not there.
    out: PathBuf,
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    place: PlaceArgs,
    /// A new file begins after so long, in seconds.
    #[arg(long, value_name = "S", default_value = "60", value_parser = seconds)]
    split: Duration,
    /// The oldest files are removed where all together have more megabytes.
    #[arg(long, value_name = "MB", value_parser = clap::value_parser!(u64).range(16..))]
    keep: Option<u64>,
    /// Wait for the next session when one is over.
    #[arg(long)]
    stay: bool,
}

#[derive(Debug, Args)]
struct WatchArgs {
    #[command(flatten)]
    place: PlaceArgs,
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
        Command::Control(args) => run_control(args),
        Command::Record(args) => run_record(args),
        Command::Watch(args) => watch(&args.place.address()).map(|()| ExitCode::SUCCESS),
        Command::Acknowledge(args) => acknowledge(&args.address()).map(|()| ExitCode::SUCCESS),
        Command::Header => print_header(),
    };
    result.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::from(FAILED)
    })
}

impl LoopArgs {
    fn real_time(&self) -> Result<RealTime> {
        if self.priority.is_some() && self.wake == Wake::Poll {
            bail!(
                "--priority with --wake poll: under SCHED_FIFO the kernel stops who never sleeps for 50 ms of every second; expected --wake event or microseconds"
            );
        }
        Ok(RealTime {
            lock_memory: self.lock_memory,
            core: self.core,
            priority: self.priority,
        })
    }
}

impl PlaceArgs {
    fn address(&self) -> ServiceAddress {
        ServiceAddress {
            service: self.service.clone(),
            prefix: self.prefix.clone(),
        }
    }
}

fn print_header() -> Result<ExitCode> {
    use std::io::Write;
    std::io::stdout().write_all(c_header().as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

fn run_replay(args: &ReplayArgs) -> Result<ExitCode> {
    let file = MachineFile::read(&args.machine.machine)?;
    let mut recording = Recording::read(&args.log, &file, args.machine.urdf.as_deref())?;
    recording.set_identity();
    recording.session.pace = args.speed.pace();
    let joined = LiveNode::new(&args.place.address(), "tipwatch-replay")?;
    let default_wait = if args.lossless { LOSSLESS_WAIT_S } else { 0.0 };
    let options = ReplayOptions {
        speed: args.speed,
        lossless: args.lossless,
        readers: args.readers,
        wait: args.wait.unwrap_or(Duration::from_secs_f64(default_wait)),
    };
    let counts = replay(&recording, &joined, options)?;
    eprintln!(
        "replay: {} of {} samples sent{}",
        counts.sent,
        recording.session.total_samples,
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
    let real_time = args.running.real_time()?;
    let file = MachineFile::read(&args.machine.machine)?;
    let urdf = file.urdf(args.machine.urdf.as_deref(), None)?;
    let place = args.place.address();
    let joined = LiveNode::new(&place, "tipwatch-monitor")?;
    let options = LoopOptions {
        wake: args.running.wake,
        stays: args.running.stay,
    };
    let format = if args.json {
        Format::Json
    } else {
        Format::Text
    };
    let mut listener = ProgramObserver::start(
        (!args.quiet).then_some(format),
        Housekeeping::start(&place)?,
    )?;
    let mut monitor = MonitorProgram::new(&joined, &file, &urdf, &Monotonic, options)?;
    real_time.apply()?;
    let ran = monitor.run(&mut listener);
    let unprinted = listener.finish()?;
    let counts = ran?;
    eprintln!(
        "monitor: {} rows; samples: {} lost, {} refused, {} repeated, {} sent before joining",
        counts.rows, counts.lost, counts.refused, counts.repeated, counts.before_joining
    );
    if unprinted > 0 {
        eprintln!(
            "monitor: {unprinted} verdicts were not printed, because they were read too slowly"
        );
    }
    Ok(ExitCode::SUCCESS)
}

fn run_control(args: &ControlArgs) -> Result<ExitCode> {
    let real_time = args.running.real_time()?;
    let file = MachineFile::read(&args.machine.machine)?;
    let urdf = file.urdf(args.machine.urdf.as_deref(), None)?;
    let place = args.place.address();
    let joined = LiveNode::new(&place, "tipwatch-control")?;
    let options = LoopOptions {
        wake: args.running.wake,
        stays: args.running.stay,
    };
    let watch_over = Housekeeping::start(&place)?;
    let mut control = ControlProgram::new(&joined, &file, &urdf, &Monotonic, options)?;
    real_time.apply()?;
    let counts = control.run(&watch_over)?;
    eprintln!(
        "control: {} rows; samples: {} lost, {} refused, {} repeated",
        counts.rows, counts.lost, counts.refused, counts.repeated
    );
    Ok(ExitCode::SUCCESS)
}

fn run_record(args: &RecordArgs) -> Result<ExitCode> {
    let file = MachineFile::read(&args.machine.machine)?;
    let urdf = file.urdf(args.machine.urdf.as_deref(), None)?;
    let joined = LiveNode::new(&args.place.address(), "tipwatch-record")?;
    let options = RecordOptions {
        folder: args.out.clone(),
        split: args.split,
        keep_bytes: args.keep.map(|megabytes| megabytes << 20),
        stays: args.stay,
    };
    let counts = record(&joined, &file, &urdf, &options)?;
    eprintln!(
        "record: {} samples, {} verdicts, {} commands in {}; not recorded: {} samples, {} verdicts; \
         refused: {} samples",
        counts.samples,
        counts.verdicts,
        counts.commands,
        args.out.display(),
        counts.samples_lost,
        counts.verdicts_lost,
        counts.samples_refused
    );
    let is_complete = counts.samples_lost == 0 && counts.verdicts_lost == 0;
    Ok(if is_complete {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(LOST)
    })
}
