//! The command line: what may be asked, and asking it.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use clap::{Args, Parser, Subcommand};
use tipwatch_binding::{MachineFile, NOT_COMMISSIONED, commissioning_of};
use tipwatch_can::CanId;
use tipwatch_ingest::Log;
use tipwatch_mechanics::commissioning::Status;
use tipwatch_mechanics::verdict::Level;
use tipwatch_storage::redact;

use crate::alarm::default_folder;
use crate::bridge::input::CanInput;
use crate::bridge::output::{CommandRule, dbc, verdict_msg};
use crate::bridge::session::Stamps;
use crate::bridge::{BridgeOptions, OutputOptions, PlayOptions, bridge, play};
use crate::control::ControlProgram;
use crate::monitor::output::Format;
use crate::monitor::{MonitorOptions, MonitorProgram, ProgramObserver};
use crate::node::Wake;
use crate::node::{Housekeeping, LoopOptions};
use crate::node::{LiveNode, ServiceAddress};
use crate::operator::acknowledge;
use crate::operator::commission;
use crate::operator::watch;
use crate::record::{ClipOptions, RecordOptions, Trigger, record};
use crate::replay::LogSamples;
use crate::replay::{ReplayOptions, Speed, replay};
use crate::system::clock::Monotonic;
use crate::system::realtime::RealTime;
use crate::wire::c_header::c_header;
use crate::wire::fingerprint::Fingerprint;
use crate::wire::session::Untimed;
use crate::wire::topics::DEFAULT_SERVICE;

/// Exit code: a file, the machine or the shared memory has failed.
const FAILED: u8 = 1;
/// Exit code: finished, but parts of a log or of a recording were lost.
const LOST: u8 = 3;
/// Exit code: the commissioning contradicts the machine file.
const CONTRADICTED: u8 = 4;
/// Exit code: the commissioning leaves items open. Adds to [`CONTRADICTED`].
const OPEN: u8 = 8;
/// Default time for which a lossless replay waits for its reader (s).
const LOSSLESS_WAIT_S: f64 = 10.0;

/// Identifier of the verdict's CAN frame: a proprietary parameter group of SAE J1939.
const DEFAULT_CAN_ID: &str = "18FF70E5";

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
    /// Receive samples and publish verdicts: how close the machine is to tipping.
    Monitor(MonitorArgs),
    /// Receive samples and verdicts and control the active suspension.
    Control(ControlArgs),
    /// Record samples, verdicts and commands in MCAP files.
    Record(RecordArgs),
    /// Show loads, margins and the verdict in the terminal.
    Watch(WatchArgs),
    /// Acknowledge the monitor's alarm.
    Acknowledge(ServiceArgs),
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

#[derive(Debug, Args)]
struct MachineArgs {
    /// The machine file.
    #[arg(long)]
    machine: PathBuf,
    /// The URDF, if the machine file names none.
    #[arg(long, value_name = "FILE")]
    urdf: Option<PathBuf>,
}

#[derive(Debug, Args)]
struct ServiceArgs {
    /// Name of the services in shared memory.
    #[arg(long, value_name = "NAME", default_value = DEFAULT_SERVICE)]
    service: String,
    /// Prefix of all files in shared memory. Programs with different prefixes do not see each other.
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
    service: ServiceArgs,
    /// Speed relative to the recording, or "max".
    #[arg(long, value_name = "X", default_value = "1", value_parser = speed)]
    speed: Speed,
    /// Wait for readers instead of overwriting samples that they have not read.
    #[arg(long)]
    lossless: bool,
    /// Number of readers to wait for before the first sample.
    #[arg(long, value_name = "N", default_value_t = 1)]
    readers: usize,
    /// How long to wait for them, in seconds. Default: 10 with --lossless, otherwise 0.
    #[arg(long, value_name = "S", value_parser = seconds)]
    wait: Option<Duration>,
}

#[derive(Debug, Args)]
struct MonitorArgs {
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    service: ServiceArgs,
    /// Print every row as one line of JSON.
    #[arg(long, conflicts_with = "quiet")]
    json: bool,
    /// Print nothing; verdicts go to shared memory only.
    #[arg(long, short)]
    quiet: bool,
    /// Folder that keeps the latched alarm over restarts. Default: $STATE_DIRECTORY, else $XDG_STATE_HOME/tipwatch,
    /// else ~/.local/state/tipwatch.
    #[arg(long, value_name = "DIR")]
    state: Option<PathBuf>,
    /// Result of the machine's commissioning, instead of the one that the machine file names. One of another machine, or
    /// one that contradicts the machine file, is refused.
    #[arg(long, value_name = "FILE")]
    commissioning: Option<PathBuf>,
    /// Follow sessions whose clock is unrelated to real time: replays as fast as possible. No delay is checked in them.
    #[arg(long)]
    allow_untimed: bool,
    #[command(flatten)]
    running: LoopArgs,
}

#[derive(Debug, Args)]
struct ControlArgs {
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    service: ServiceArgs,
    #[command(flatten)]
    running: LoopArgs,
}

#[derive(Debug, Args)]
struct LoopArgs {
    /// Wait for the next session when one has ended.
    #[arg(long)]
    stay: bool,
    /// How to wait for samples: "poll" (fastest, occupies a processor core), "event", or a sleep in microseconds.
    #[arg(long, default_value = "event")]
    wake: Wake,
    /// Lock all memory in RAM.
    #[arg(long)]
    lock_memory: bool,
    /// The processor core to run on.
    #[arg(long, value_name = "N")]
    core: Option<usize>,
    /// Real-time priority (SCHED_FIFO), 1 to 99. Not with --wake poll.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(i32).range(1..=99))]
    priority: Option<i32>,
}

#[derive(Debug, Args)]
struct RecordArgs {
    /// The folder for the files. It is created if necessary.
    out: PathBuf,
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    service: ServiceArgs,
    /// Length of a file, in seconds.
    #[arg(long, value_name = "S", default_value = "60", value_parser = seconds, conflicts_with = "on")]
    split: Duration,
    /// Limit on the size of all files, in megabytes: beyond it the oldest are removed.
    #[arg(long, value_name = "MB", value_parser = clap::value_parser!(u64).range(16..))]
    keep: Option<u64>,
    /// Wait for the next session when one has ended.
    #[arg(long)]
    stay: bool,
    #[command(flatten)]
    clips: ClipArgs,
}

/// The black box.
#[derive(Debug, Args)]
struct ClipArgs {
    /// Black box: keep the last seconds in memory and write a file, a clip, only around verdicts that meet one of these
    /// conditions.
    #[arg(long, value_enum, value_name = "CONDITION", value_delimiter = ',')]
    on: Vec<Trigger>,
    /// Time before the first trigger of a clip, in seconds.
    #[arg(long, value_name = "S", default_value = "30", value_parser = seconds, requires = "on")]
    before: Duration,
    /// Time after the last trigger of a clip, in seconds.
    #[arg(long, value_name = "S", default_value = "10", value_parser = seconds, requires = "on")]
    after: Duration,
    /// Longest clip, in seconds. A longer one goes on in the next file.
    #[arg(long, value_name = "S", default_value = "600", value_parser = a_second_or_more, requires = "on")]
    longest: Duration,
    /// Memory for the time before a trigger, in megabytes.
    #[arg(long, value_name = "MB", default_value = "64", value_parser = clap::value_parser!(u32).range(1..), requires = "on")]
    ring: u32,
}

#[derive(Debug, Args)]
struct BridgeArgs {
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    service: ServiceArgs,
    /// Read topics of ROS 2 from this DDS domain (default: $ROS_DOMAIN_ID, else 0), and publish /diagnostics and /tipwatch/verdict there.
    #[arg(long, value_name = "DOMAIN", num_args = 0..=1)]
    #[allow(
        clippy::option_option,
        reason = "the option may stand without its value"
    )]
    dds: Option<Option<u16>>,
    /// Address of this computer on the network that DDS uses; may be given several times. Default: all networks.
    #[arg(long, value_name = "IP")]
    dds_address: Vec<IpAddr>,
    /// Read messages from standard input as a stream of MCAP, from a program that reads another network, such as Zenoh.
    #[arg(long)]
    mcap: bool,
    /// A log with the definitions of message types that are not built in.
    #[arg(long, value_name = "LOG")]
    definitions: Option<PathBuf>,
    /// Read the frames of a CAN interface; "-" for the text of candump -L on standard input. The frames are the topic
    /// of the interface's name, or of the name behind "=". May be given several times.
    #[arg(long, value_name = "IFACE[=TOPIC]")]
    can: Vec<CanInput>,
    /// Read frames of CAN FD too.
    #[arg(long)]
    can_fd: bool,
    /// What the stamps of the messages are.
    #[arg(long, default_value = "auto")]
    stamps: Stamps,
    /// Send the verdict as CAN frames to this interface; "-" for the text of candump on standard output. `tipwatch-live
    /// dbc` writes their DBC file.
    #[arg(long, value_name = "IFACE")]
    can_out: Option<String>,
    /// Identifier of those frames, hexadecimal; above 7FF it has 29 bits.
    #[arg(long, value_name = "ID", default_value = DEFAULT_CAN_ID, value_parser = can_id)]
    can_id: CanId,
    /// Publish nothing on DDS.
    #[arg(long)]
    no_verdicts: bool,
    /// Run the command of the --run at the same place when the level to act on reaches this one (notice, warning, danger
    /// or fault), and when it is left again.
    #[arg(long, value_name = "LEVEL", value_parser = level)]
    on_level: Vec<Level>,
    /// The command, for sh -c. The environment tells it what happened: TIPWATCH_EVENT, TIPWATCH_LEVEL, TIPWATCH_WHEEL.
    #[arg(long, value_name = "COMMAND")]
    run: Vec<String>,
    /// After this time a command is killed, in seconds.
    #[arg(long, value_name = "S", default_value = "10", value_parser = seconds)]
    run_limit: Duration,
    /// How long to wait for the sensors of the machine file, in seconds.
    #[arg(long, value_name = "S", default_value = "30", value_parser = seconds)]
    wait: Duration,
    /// Wait for ever.
    #[arg(long)]
    stay: bool,
}

#[derive(Debug, Args)]
struct PlayArgs {
    /// The log.
    log: PathBuf,
    /// Publish its topics in this DDS domain (default: $ROS_DOMAIN_ID, else 0); without it the frames of a CAN log go to standard output as candump text.
    #[arg(long, value_name = "DOMAIN", num_args = 0..=1)]
    #[allow(
        clippy::option_option,
        reason = "the option may stand without its value"
    )]
    dds: Option<Option<u16>>,
    /// Address of this computer on the network that DDS uses; may be given several times. Default: all networks.
    #[arg(long, value_name = "IP")]
    dds_address: Vec<IpAddr>,
    /// Speed relative to the recording.
    #[arg(long, value_name = "X", default_value_t = 1.0)]
    speed: f64,
    /// Time between the announcement of the topics and the first message, in seconds.
    #[arg(long, value_name = "S", default_value = "2", value_parser = seconds)]
    delay: Duration,
    /// Begin again at the end.
    #[arg(long = "loop")]
    repeats: bool,
}

#[derive(Debug, Args)]
struct DbcArgs {
    /// Identifier of the frames, hexadecimal; above 7FF it has 29 bits.
    #[arg(long, value_name = "ID", default_value = DEFAULT_CAN_ID, value_parser = can_id)]
    can_id: CanId,
}

#[derive(Debug, Args)]
struct CheckMachineArgs {
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    service: ServiceArgs,
    /// Write the result to this file, which the key `commissioning` of the machine file binds.
    #[arg(long, value_name = "FILE")]
    commissioning: Option<PathBuf>,
}

#[derive(Debug, Args)]
struct WatchArgs {
    #[command(flatten)]
    service: ServiceArgs,
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

fn can_id(text: &str) -> Result<CanId, String> {
    let digits = text.trim_start_matches("0x");
    match u32::from_str_radix(digits, 16) {
        Ok(raw) if raw <= 0x7ff => Ok(CanId::standard(raw)),
        Ok(raw) if raw <= 0x1fff_ffff => Ok(CanId::extended(raw)),
        _ => Err("expected a hexadecimal identifier up to 1FFFFFFF".into()),
    }
}

fn level(text: &str) -> Result<Level, String> {
    let can_be_reached = [Level::Notice, Level::Warning, Level::Danger, Level::Fault];
    let found = can_be_reached
        .into_iter()
        .find(|level| level.name() == text);
    found.ok_or_else(|| "expected notice, warning, danger or fault".into())
}

fn seconds(text: &str) -> Result<Duration, String> {
    let number = text
        .parse()
        .ok()
        .and_then(|number| Duration::try_from_secs_f64(number).ok());
    number.ok_or_else(|| "expected a non-negative number of seconds".into())
}

fn a_second_or_more(text: &str) -> Result<Duration, String> {
    let duration = seconds(text)?;
    match duration >= Duration::from_secs(1) {
        true => Ok(duration),
        false => Err("expected one second or more".into()),
    }
}

/// Runs the command.
#[must_use]
pub fn run(cli: &Cli) -> ExitCode {
    let result = match &cli.command {
        Command::Replay(args) => run_replay(args),
        Command::Monitor(args) => run_monitor(args),
        Command::Control(args) => run_control(args),
        Command::Record(args) => run_record(args),
        Command::Watch(args) => watch(&args.service.address()).map(|()| ExitCode::SUCCESS),
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

impl LoopArgs {
    fn real_time(&self) -> Result<RealTime> {
        if self.priority.is_some() && self.wake == Wake::Poll {
            bail!(
                "--priority with --wake poll: the kernel throttles a busy-polling SCHED_FIFO thread for 50 ms of every second; expected --wake event or microseconds"
            );
        }
        Ok(RealTime {
            lock_memory: self.lock_memory,
            core: self.core,
            priority: self.priority,
        })
    }
}

impl ClipArgs {
    fn options(&self) -> Option<ClipOptions> {
        let mut on = self.on.clone();
        on.sort_unstable();
        on.dedup();
        (!on.is_empty()).then_some(ClipOptions {
            on,
            before: self.before,
            after: self.after,
            longest: self.longest,
            ring_bytes: (self.ring as usize) << 20,
        })
    }
}

impl ServiceArgs {
    fn address(&self) -> ServiceAddress {
        ServiceAddress {
            service: self.service.clone(),
            prefix: self.prefix.clone(),
        }
    }
}

fn run_acknowledge(args: &ServiceArgs) -> Result<ExitCode> {
    let outcome = acknowledge(&args.address())?;
    eprintln!("acknowledge: {outcome}");
    Ok(ExitCode::SUCCESS)
}

fn print_header() -> Result<ExitCode> {
    use std::io::Write;
    std::io::stdout().write_all(c_header().as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

fn run_replay(args: &ReplayArgs) -> Result<ExitCode> {
    let file = MachineFile::read(&args.machine.machine)?;
    let mut log_samples = LogSamples::read(&args.log, &file, args.machine.urdf.as_deref())?;
    log_samples.set_identity();
    log_samples.session.pace = args.speed.pace();
    let node = LiveNode::new(&args.service.address(), "tipwatch-replay")?;
    let default_wait = if args.lossless { LOSSLESS_WAIT_S } else { 0.0 };
    let options = ReplayOptions {
        speed: args.speed,
        lossless: args.lossless,
        readers: args.readers,
        wait: args.wait.unwrap_or(Duration::from_secs_f64(default_wait)),
    };
    let counts = replay(&log_samples, &node, options)?;
    eprintln!(
        "replay: {} of {} samples sent{}",
        counts.sent,
        log_samples.session.total_samples,
        if counts.interrupted {
            ", stopped by a signal"
        } else {
            ""
        }
    );
    Ok(if log_samples.losses.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(LOST)
    })
}

fn run_bridge(args: &BridgeArgs) -> Result<ExitCode> {
    let file = MachineFile::read(&args.machine.machine)?;
    let urdf = file.urdf(args.machine.urdf.as_deref(), None)?;
    let mut can = args.can.clone();
    for input in &mut can {
        input.is_fd = args.can_fd;
    }
    if can.is_empty() && args.dds.is_none() && !args.mcap {
        bail!("bridge: expected at least one network, --dds, --can IFACE or --mcap, found none");
    }
    let of_stdin =
        can.iter().filter(|input| input.interface == "-").count() + usize::from(args.mcap);
    if of_stdin > 1 {
        bail!("bridge: expected one use of standard input, found {of_stdin}: --can - and --mcap");
    }
    if args.on_level.len() != args.run.len() {
        bail!(
            "bridge: expected one --run for every --on-level, found {} and {}",
            args.run.len(),
            args.on_level.len()
        );
    }
    let mut definitions = BTreeMap::new();
    if let Some(path) = &args.definitions {
        for topic in Log::open(path)?.topics() {
            let is_ros = topic.schema_encoding == "ros2msg";
            if let Some(definition) = topic.definition.clone().filter(|_| is_ros) {
                definitions.insert(topic.type_name.clone(), definition);
            }
        }
    }
    let rules = args.on_level.iter().zip(&args.run);
    let options = BridgeOptions {
        dds: domain(args.dds)?,
        addresses: args.dds_address.clone(),
        definitions,
        mcap: args.mcap,
        can,
        outputs: OutputOptions {
            publishes: !args.no_verdicts,
            can: args
                .can_out
                .clone()
                .map(|interface| (interface, args.can_id)),
            commands: rules
                .map(|(level, command)| CommandRule {
                    level: *level,
                    command: command.clone(),
                    limit: args.run_limit,
                })
                .collect(),
        },
        stamps: args.stamps,
        wait: (!args.stay).then_some(args.wait),
    };
    let address = args.service.address();
    let node = LiveNode::new(&address, "tipwatch-bridge")?;
    let housekeeping = Housekeeping::start(&address)?;
    let counts = bridge(&node, &address, &file, &urdf, &options, &housekeeping)?;
    let of = counts.of_messages;
    eprintln!(
        "bridge: {} sessions, {} messages, {} samples sent; messages: {} lost, {} repeated, {} of two publishers, {} \
         undecodable",
        counts.sessions,
        of.messages,
        of.sent,
        of.lost,
        of.repeated,
        of.of_two_publishers,
        of.undecodable
    );
    Ok(ExitCode::from(
        match of.lost + of.of_two_publishers + of.undecodable {
            0 => 0,
            _ => LOST,
        },
    ))
}

/// The domain of DDS: as given, else `ROS_DOMAIN_ID`, else 0.
#[allow(
    clippy::option_option,
    reason = "the option may stand without its value"
)]
fn domain(given: Option<Option<u16>>) -> Result<Option<u16>> {
    let domain = match given {
        None => return Ok(None),
        Some(Some(domain)) => domain,
        Some(None) => match std::env::var("ROS_DOMAIN_ID") {
            Ok(text) => text.trim().parse().map_err(|_| {
                anyhow!("ROS_DOMAIN_ID: expected a number from 0 to 232, found \"{text}\"")
            })?,
            Err(_) => 0,
        },
    };
    if domain > 232 {
        bail!("--dds: expected a domain from 0 to 232, found {domain}");
    }
    Ok(Some(domain))
}

fn run_play(args: &PlayArgs) -> Result<ExitCode> {
    if !(args.speed.is_finite() && args.speed > 0.0) {
        bail!("--speed: expected a positive number, found {}", args.speed);
    }
    let sent = play(&PlayOptions {
        log: args.log.clone(),
        dds: domain(args.dds)?,
        addresses: args.dds_address.clone(),
        speed: args.speed,
        delay: args.delay,
        repeats: args.repeats,
    })?;
    eprintln!("play: {sent} messages sent");
    Ok(ExitCode::SUCCESS)
}

fn print_dbc(args: &DbcArgs) -> Result<ExitCode> {
    use std::io::Write;
    std::io::stdout().write_all(dbc(args.can_id).as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

fn print_msg(args: &MachineArgs) -> Result<ExitCode> {
    use std::io::Write;
    let mut file = MachineFile::read(&args.machine)?;
    if let Some(urdf) = &args.urdf {
        file = file.with_urdf(urdf)?;
    }
    let text = verdict_msg(&file.check_alone()?)?;
    std::io::stdout().write_all(text.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

fn run_check_machine(args: &CheckMachineArgs) -> Result<ExitCode> {
    let file = MachineFile::read(&args.machine.machine)?;
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

fn run_monitor(args: &MonitorArgs) -> Result<ExitCode> {
    let real_time = args.running.real_time()?;
    let mut file = MachineFile::read(&args.machine.machine)?;
    if let Some(path) = &args.commissioning {
        file = file.with_commissioning(path)?;
    }
    let urdf = file.urdf(args.machine.urdf.as_deref(), None)?;
    let commissioning = commissioning_of(&file, &urdf)?;
    if !args.quiet {
        let statement = (commissioning.as_ref())
            .map_or(NOT_COMMISSIONED.into(), |(_, found)| found.statement());
        eprintln!("monitor: {statement}");
    }
    let bound = commissioning.as_ref().map(|(path, _)| path.as_path());
    let fingerprint = Fingerprint::of_this_program(&file, &urdf, bound)?;
    if !args.quiet {
        eprintln!("monitor: {}", fingerprint.statement());
    }
    let state = args
        .state
        .clone()
        .or_else(|| default_folder(|name| std::env::var_os(name)));
    let state = state.context(
        "expected --state DIR, because none of $STATE_DIRECTORY, $XDG_STATE_HOME and $HOME is known: the latched alarm \
         must outlive a restart",
    )?;
    let address = args.service.address();
    let node = LiveNode::new(&address, "tipwatch-monitor")?;
    let options = MonitorOptions {
        running: LoopOptions {
            wake: args.running.wake,
            stays: args.running.stay,
        },
        untimed: if args.allow_untimed {
            Untimed::Allowed
        } else {
            Untimed::Refused
        },
        state: &state,
    };
    let format = if args.json {
        Format::Json
    } else {
        Format::Text
    };
    let mut observer = ProgramObserver::start(
        (!args.quiet).then_some(format),
        Housekeeping::start(&address)?,
    )?;
    let mut monitor = MonitorProgram::new(&node, &file, &urdf, &Monotonic, options)?
        .with_fingerprint(&fingerprint);
    real_time.apply()?;
    let ran = monitor.run(&mut observer);
    let unprinted = observer.finish()?;
    let counts = ran?;
    eprintln!(
        "monitor: {} rows; samples: {} lost, {} refused, {} repeated, {} sent before joining",
        counts.rows, counts.lost, counts.refused, counts.repeated, counts.before_joining
    );
    let ignored = monitor.ignored_acknowledgements();
    if ignored > 0 {
        eprintln!(
            "monitor: {ignored} acknowledgements did not count: they named no verdict with the alarm"
        );
    }
    if unprinted > 0 {
        eprintln!(
            "monitor: {unprinted} verdicts were not printed because stdout was read too slowly"
        );
    }
    Ok(ExitCode::SUCCESS)
}

fn run_control(args: &ControlArgs) -> Result<ExitCode> {
    let real_time = args.running.real_time()?;
    let file = MachineFile::read(&args.machine.machine)?;
    let urdf = file.urdf(args.machine.urdf.as_deref(), None)?;
    // one of another machine, or with contradictions, is refused
    let commissioning = commissioning_of(&file, &urdf)?;
    let bound = commissioning.as_ref().map(|(path, _)| path.as_path());
    let fingerprint = Fingerprint::of_this_program(&file, &urdf, bound)?;
    eprintln!("control: {}", fingerprint.statement());
    let address = args.service.address();
    let node = LiveNode::new(&address, "tipwatch-control")?;
    let options = LoopOptions {
        wake: args.running.wake,
        stays: args.running.stay,
    };
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

fn run_record(args: &RecordArgs) -> Result<ExitCode> {
    let file = MachineFile::read(&args.machine.machine)?;
    let urdf = file.urdf(args.machine.urdf.as_deref(), None)?;
    let node = LiveNode::new(&args.service.address(), "tipwatch-record")?;
    let options = RecordOptions {
        folder: args.out.clone(),
        split: args.split,
        keep_bytes: args.keep.map(|megabytes| megabytes << 20),
        stays: args.stay,
        fingerprint: Fingerprint::of_this_program(&file, &urdf, None)?,
        clips: args.clips.options(),
    };
    eprintln!("record: {}", options.fingerprint.statement());
    let counts = record(&node, &file, &urdf, &options)?;
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
    if args.clips.options().is_some() {
        eprintln!(
            "record: {} clips, {} of them shorter than asked for",
            counts.clips, counts.short_clips
        );
    }
    let is_complete =
        counts.samples_lost == 0 && counts.verdicts_lost == 0 && counts.short_clips == 0;
    Ok(if is_complete {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(LOST)
    })
}
