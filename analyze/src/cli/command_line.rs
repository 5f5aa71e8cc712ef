//! The commands of `tipwatch`, and how one is run.

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use tipwatch_ingest::set_read_options;

use super::analyze::AnalyzeArgs;
use super::exit::{Exit, Terminal, Usage};
use super::reading::ReadingArgs;
use super::{
    analyze, chart, check_machine, compare, demo, identify, inspect, machine, query, recover,
    screen, stabilise, validate, verify, whatif,
};
use crate::base::stdout::to_stdout;
use crate::output::custody::Custody;
use crate::tables::summary;

/// Computes from logs how close a wheeled machine came to tipping over.
#[derive(Debug, Parser)]
#[command(name = "tipwatch", version, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Print only errors.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Print more.
    #[arg(short, long, global = true)]
    verbose: bool,
    /// Transfer logs of buckets and web servers as a whole where their format has no index of its parts.
    #[arg(long, global = true)]
    fetch_whole: bool,
    #[command(flatten)]
    reading: ReadingArgs,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Compute wheel loads, stability and events of logs.
    Analyze(AnalyzeArgs),
    /// Analyse many logs: a data set with one row per log, and a page that ranks the machines by risk.
    Screen(screen::ScreenArgs),
    /// Ask the data set of a fleet in SQL.
    Query(query::QueryArgs),
    /// Compare two results, two logs, or one log under two machine files or models.
    Compare(compare::CompareArgs),
    /// Show the contents of a log: topics, clocks, gaps, damage, and the topic of each signal.
    Inspect(inspect::InspectArgs),
    /// Show mass, centre of mass and static loads of a machine, compared with weighed loads if its file
    /// has them; prove its sensors from a log or live.
    CheckMachine(check_machine::CheckMachineArgs),
    /// Compute the load chart of a machine, and compare it with its maker's.
    Chart(chart::ChartArgs),
    /// Make a machine from its data sheet.
    Machine(machine::MachineArgs),
    /// Compare computed with measured wheel loads of logs: error, coverage of the bands, contradictions.
    Validate(validate::ValidateArgs),
    /// Estimate masses, centres of mass, positions and sensor errors of a machine from weighings, measured loads and
    /// cylinder forces, with their joint uncertainty.
    Identify(identify::IdentifyArgs),
    /// Replay a log with the suspension locked, as recorded, or controlled, and compare the wheel loads.
    Whatif(whatif::WhatIfArgs),
    /// Control an active suspension over standard input and output: one line of JSON per state and per
    /// command.
    Stabilise(stabilise::StabiliseArgs),
    /// Write the intact part of a damaged log as a clean, indexed MCAP file.
    Recover(recover::RecoverArgs),
    /// Analyse a small log that comes with the program.
    Demo(demo::DemoArgs),
    /// Repeat the analysis of an output folder from its custody record, and compare every output bit for
    /// bit.
    Verify(verify::VerifyArgs),
    /// Print the JSON schema of `summary.json`.
    Schema,
    /// Print a shell completion script.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

/// Runs the command.
#[must_use]
pub fn run(cli: &Cli) -> ExitCode {
    let terminal = Terminal {
        quiet: cli.quiet,
        verbose: cli.verbose,
    };
    if cli.fetch_whole {
        tipwatch_storage::set_whole_reads(true);
    }
    set_read_options(cli.reading.options());
    let result = match &cli.command {
        Command::Analyze(args) => analyze::run(args, terminal),
        Command::Screen(args) => screen::run(args, terminal),
        Command::Query(args) => query::run(args, terminal),
        Command::Compare(args) => compare::run(args, terminal),
        Command::Inspect(args) => inspect::run(args, terminal),
        Command::CheckMachine(args) => check_machine::run(args, terminal),
        Command::Chart(args) => chart::run(args, terminal),
        Command::Machine(args) => machine::run(args, terminal),
        Command::Validate(args) => validate::run(args, terminal),
        Command::Identify(args) => identify::run(args, terminal),
        Command::Whatif(args) => whatif::run(args, terminal),
        Command::Stabilise(args) => stabilise::run(args),
        Command::Recover(args) => recover::run(args, terminal),
        Command::Demo(args) => demo::run(args, terminal),
        Command::Verify(args) => verify::run(args, terminal, recorded_analysis),
        Command::Schema => to_stdout(&summary::json_schema()).map(|()| Exit::DONE),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "tipwatch", &mut script);
            to_stdout(&String::from_utf8_lossy(&script)).map(|()| Exit::DONE)
        }
    };
    result
        .unwrap_or_else(|error| {
            if let Some(Usage(mistake)) = error.downcast_ref() {
                Cli::command()
                    .error(ErrorKind::ValueValidation, mistake)
                    .exit()
            }
            terminal.error(&error);
            Exit::FAILED
        })
        .into()
}

/// The arguments of a recorded analysis, which also state how its log is read; the demo is an analysis with default
/// options.
///
/// # Errors
/// The recorded command line is none of `analyze` or `demo`.
fn recorded_analysis(record: &Custody) -> anyhow::Result<AnalyzeArgs> {
    let analysis_of_demo = [
        "tipwatch",
        "analyze",
        &record.log,
        "--machine",
        &record.machine_file,
        "--out",
        ".",
    ];
    let recorded = Cli::try_parse_from(&record.command_line)?;
    set_read_options(recorded.reading.options());
    let command = match recorded.command {
        Command::Demo(_) => Cli::try_parse_from(analysis_of_demo)?.command,
        other => other,
    };
    match command {
        Command::Analyze(args) => Ok(args),
        _ => anyhow::bail!("expected the command line of \"analyze\" or \"demo\""),
    }
}
