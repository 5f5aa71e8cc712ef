//! The command line: what may be asked, and asking it.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::{Args, CommandFactory, Parser, Subcommand};
use tipwatch_ingest::{Log, recover};

use crate::analysis::Analysis;
use crate::events::EventKind;
use crate::imu_check::FAULT;
use crate::load::MachineFile;
use crate::options::{ClosedFormInput, ColumnGroup, Estimator, Model, MoreColumns, Options};
use crate::output::Outputs;
use crate::progress::Progress;
use crate::{check_machine, demo, inspect, output, report, run};

/// Exit code: a file's content, the machine or the disk is at fault.
const FAILED: u8 = 1;
/// Exit code: done, but bytes or messages of a log were lost.
const LOST: u8 = 3;
/// Exit code: the condition of `--fail-on` was met.
const CONDITION_MET: u8 = 4;

/// How close a wheeled machine came to tipping over, from the logs that it keeps.
#[derive(Debug, Parser)]
#[command(name = "tipwatch", version, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Say nothing but errors.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Say more.
    #[arg(short, long, global = true)]
    verbose: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Wheel loads, stability and events of logs.
    Analyze(AnalyzeArgs),
    /// What a log holds: topics, clocks, gaps, damage, and what would be bound to which signal.
    Inspect(InspectArgs),
    /// Mass, centre of mass and static loads of a machine, beside weighed loads if its file has them.
    CheckMachine(CheckMachineArgs),
    /// Write the intact part of a damaged log, of any format, as a clean, indexed MCAP file.
    Recover {
        /// The log.
        log: PathBuf,
        /// The new file; one that exists is never overwritten.
        #[arg(short, long, value_name = "FILE")]
        out: PathBuf,
    },
    /// Analyse a small log that comes with the program.
    Demo {
        /// Where the results go.
        #[arg(long, default_value = "tipwatch-demo")]
        out: PathBuf,
    },
    /// Print the completion script of a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

#[derive(Debug, Args)]
struct AnalyzeArgs {
    /// The logs: .mcap, .bag, .db3 or rosbag2 folders.
    #[arg(required = true)]
    logs: Vec<PathBuf>,
    /// The machine file.
    #[arg(long)]
    machine: PathBuf,
    /// Where the results go: straight for one log, into DIR/<name of the log>/ for several.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// How the ground wrench is computed.
    #[arg(long, value_enum, default_value_t = Model::WholeBody)]
    model: Model,
    /// How signals become states.
    #[arg(long, value_enum, default_value_t = Estimator::Smoother)]
    estimator: Estimator,
    /// Rows at this rate instead of at the stamps of the fastest joint stream.
    #[arg(long, value_name = "HZ", value_parser = positive)]
    rate: Option<f64>,
    /// Rows from here on (s from the first sample).
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    from: Option<f64>,
    /// Rows up to here (s from the first sample).
    #[arg(long, value_name = "S")]
    to: Option<f64>,
    /// Where the closed form takes the platform's acceleration from; default: velocity if the log has
    /// odometry.
    #[arg(long, value_enum, value_name = "SIGNAL")]
    closed_form_input: Option<ClosedFormInput>,
    /// Draw N machines with all lengths, angles, masses and inertias up to 10 % off, and write the bands
    /// that the loads spread over.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    monte_carlo: Option<u32>,
    /// Further columns of samples.parquet; may be repeated.
    #[arg(long, value_enum, value_delimiter = ',')]
    columns: Vec<ColumnGroup>,
    /// Which files to write.
    #[arg(long, value_enum, default_value_t = Outputs::All)]
    outputs: Outputs,
    /// End with exit code 4 if there is such an event; may be repeated.
    #[arg(long, value_name = "EVENT", value_enum)]
    fail_on: Vec<EventKind>,
}

#[derive(Debug, Args)]
struct InspectArgs {
    /// The log.
    log: PathBuf,
    /// A machine file whose [signals] to bind.
    #[arg(long)]
    machine: Option<PathBuf>,
    /// As JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct CheckMachineArgs {
    /// The machine file.
    machine: PathBuf,
    /// A log: loads in the posture of its first valid row, instead of with all joints at zero.
    #[arg(long)]
    log: Option<PathBuf>,
    /// As JSON.
    #[arg(long)]
    json: bool,
}

fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number".to_string())?;
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err("expected a positive number".into())
    }
}

/// What a command ends with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Verdict {
    Done,
    Lost,
    ConditionMet,
    Failed,
}

impl From<Verdict> for ExitCode {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Done => Self::SUCCESS,
            Verdict::Lost => Self::from(LOST),
            Verdict::ConditionMet => Self::from(CONDITION_MET),
            Verdict::Failed => Self::from(FAILED),
        }
    }
}

/// Does what the command line asks.
#[must_use]
pub fn run(cli: &Cli) -> ExitCode {
    let voice = Voice {
        quiet: cli.quiet,
        verbose: cli.verbose,
    };
    let result = match &cli.command {
        Command::Analyze(args) => analyze(args, voice),
        Command::Inspect(args) => inspect_log(args),
        Command::CheckMachine(args) => check_one_machine(args),
        Command::Recover { log, out } => recover_log(log, out, voice),
        Command::Demo { out } => run_demo(out, voice),
        Command::Completions { shell } => {
            clap_complete::generate(
                *shell,
                &mut Cli::command(),
                "tipwatch",
                &mut std::io::stdout(),
            );
            Ok(Verdict::Done)
        }
    };
    result
        .unwrap_or_else(|error| {
            voice.error(&error);
            Verdict::Failed
        })
        .into()
}

/// What is said, to stderr.
#[derive(Debug, Clone, Copy)]
struct Voice {
    quiet: bool,
    verbose: bool,
}

impl Voice {
    fn say(self, text: &str) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }

    fn error(self, error: &anyhow::Error) {
        eprintln!("error: {error:#}");
    }
}

fn analyze(args: &AnalyzeArgs, voice: Voice) -> Result<Verdict> {
    if let (Some(from), Some(to)) = (args.from, args.to)
        && from >= to
    {
        Cli::command()
            .error(
                clap::error::ErrorKind::ValueValidation,
                "--from must be before --to",
            )
            .exit();
    }
    let file = MachineFile::read(&args.machine)?;
    let options = Options {
        estimator: args.estimator,
        model: args.model,
        rate_hz: args.rate,
        from_s: args.from,
        to_s: args.to,
        closed_form_input: args.closed_form_input,
        monte_carlo: args.monte_carlo.map(|draws| draws as usize),
        columns: MoreColumns {
            parts: args.columns.contains(&ColumnGroup::Parts),
            terms: args.columns.contains(&ColumnGroup::Terms),
        },
    };
    let mut verdict = Verdict::Done;
    for (log, out) in args.logs.iter().zip(out_folders(&args.logs, &args.out)?) {
        let one = analyze_one(log, &file, options, &out, args, voice).unwrap_or_else(|error| {
            voice.error(&error);
            Verdict::Failed
        });
        verdict = verdict.max(one);
    }
    Ok(verdict)
}

fn analyze_one(
    log: &Path,
    file: &MachineFile,
    options: Options,
    out: &Path,
    args: &AnalyzeArgs,
    voice: Voice,
) -> Result<Verdict> {
    let mut progress = Progress::new(log, voice.quiet);
    let analysis = run::analyse(log, file, options, &mut |bytes| progress.at(bytes))?;
    progress.finish();
    output::write(&analysis, out, args.outputs)?;
    report_findings(&analysis, out, voice);
    Ok(verdict(&analysis, &args.fail_on))
}

fn report_findings(analysis: &Analysis, out: &Path, voice: Voice) {
    let shown = if voice.verbose { usize::MAX } else { 3 };
    for finding in report::findings(analysis).iter().take(shown) {
        voice.say(&format!("- {finding}"));
    }
    let faults = analysis.notes.iter().filter(|n| n.starts_with(FAULT));
    faults.for_each(|fault| voice.say(&format!("- {fault}")));
    voice.say(&format!("results: {}", out.display()));
}

fn verdict(analysis: &Analysis, fail_on: &[EventKind]) -> Verdict {
    if analysis
        .events
        .iter()
        .any(|event| fail_on.contains(&event.kind))
    {
        Verdict::ConditionMet
    } else if !analysis.losses.is_empty() {
        Verdict::Lost
    } else {
        Verdict::Done
    }
}

/// Where each log's results go.
fn out_folders(logs: &[PathBuf], out: &Path) -> Result<Vec<PathBuf>> {
    if let [_] = logs {
        return Ok(vec![out.into()]);
    }
    let mut folders: Vec<PathBuf> = Vec::new();
    for log in logs {
        let stem = log
            .file_stem()
            .with_context(|| format!("{}: expected a file name, found none", log.display()))?;
        let folder = out.join(stem);
        if folders.contains(&folder) {
            bail!(
                "{}: expected logs of different names, found \"{}\" twice",
                log.display(),
                stem.display()
            );
        }
        folders.push(folder);
    }
    Ok(folders)
}

fn inspect_log(args: &InspectArgs) -> Result<Verdict> {
    let file = args.machine.as_deref().map(MachineFile::read).transpose()?;
    let inspection = inspect::inspect(&args.log, file.as_ref())?;
    inspect::print(&inspection, args.json)?;
    Ok(if inspection.losses.is_empty() {
        Verdict::Done
    } else {
        Verdict::Lost
    })
}

fn check_one_machine(args: &CheckMachineArgs) -> Result<Verdict> {
    let file = MachineFile::read(&args.machine)?;
    let check = check_machine::check(&file, args.log.as_deref())?;
    check_machine::print(&check, args.json)?;
    Ok(Verdict::Done)
}

fn recover_log(log: &Path, out: &Path, voice: Voice) -> Result<Verdict> {
    let report = recover(&Log::open(log)?, out)?;
    voice.say(&format!(
        "{} messages of {} topics written to {}",
        report.message_count(),
        report.messages.len(),
        out.display()
    ));
    if report.losses.is_empty() {
        return Ok(Verdict::Done);
    }
    for range in &report.losses.ranges {
        voice.say(&format!("lost: {range}"));
    }
    Ok(Verdict::Lost)
}

fn run_demo(out: &Path, voice: Voice) -> Result<Verdict> {
    let analysis = demo::analyse(&out.join("input"))?;
    output::write(&analysis, out, Outputs::All)?;
    demo::tell(&analysis, out);
    voice.say("the log and the machine file of the demo are in its folder input/");
    Ok(verdict(&analysis, &[]))
}
