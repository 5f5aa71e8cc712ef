//! The command line: what may be asked, and asking it. A command is a file.

mod analyze;
mod check_machine;
mod compare;
mod demo;
mod exit;
mod inspect;
mod options;
mod recover;
mod screen;
mod stabilise;
mod whatif;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};

use self::exit::{Exit, Usage, Voice};
use crate::base::stdout::to_stdout;
use crate::tables::summary;

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
    Analyze(analyze::AnalyzeArgs),
    /// Many logs: a data set with a row for each, and a page with the machines at most risk.
    Screen(screen::ScreenArgs),
    /// Two results, two logs, or one log under two machine files or models, side by side.
    Compare(compare::CompareArgs),
    /// What a log holds: topics, clocks, gaps, damage, and what would be bound to which signal.
    Inspect(inspect::InspectArgs),
    /// Mass, centre of mass and static loads of a machine, beside weighed loads if its file has them.
    CheckMachine(check_machine::CheckMachineArgs),
    /// A log again with the suspension locked, as recorded, or controlled: what it would have done to the loads.
    Whatif(whatif::WhatIfArgs),
    /// Steer an active suspension over standard input and output: a line of JSON with a state in, one with a command out.
    Stabilise(stabilise::StabiliseArgs),
    /// Write the intact part of a damaged log, of any format, as a clean, indexed MCAP file.
    Recover(recover::RecoverArgs),
    /// Analyse a small log that comes with the program.
    Demo(demo::DemoArgs),
    /// Print the JSON schema of `summary.json`.
    Schema,
    /// Print the completion script of a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

/// Does what the command line asks.
#[must_use]
pub fn run(cli: &Cli) -> ExitCode {
    let voice = Voice {
        quiet: cli.quiet,
        verbose: cli.verbose,
    };
    let result = match &cli.command {
        Command::Analyze(args) => analyze::run(args, voice),
        Command::Screen(args) => screen::run(args, voice),
        Command::Compare(args) => compare::run(args, voice),
        Command::Inspect(args) => inspect::run(args, voice),
        Command::CheckMachine(args) => check_machine::run(args),
        Command::Whatif(args) => whatif::run(args, voice),
        Command::Stabilise(args) => stabilise::run(args),
        Command::Recover(args) => recover::run(args, voice),
        Command::Demo(args) => demo::run(args, voice),
        Command::Schema => to_stdout(&summary::json_schema()).map(|()| Exit::Done),
        Command::Completions { shell } => {
            clap_complete::generate(
                *shell,
                &mut Cli::command(),
                "tipwatch",
                &mut std::io::stdout(),
            );
            Ok(Exit::Done)
        }
    };
    result
        .unwrap_or_else(|error| {
            if let Some(Usage(mistake)) = error.downcast_ref() {
                Cli::command()
                    .error(ErrorKind::ValueValidation, mistake)
                    .exit()
            }
            voice.error(&error);
            Exit::Failed
        })
        .into()
}
