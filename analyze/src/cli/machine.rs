//! `tipwatch machine`.

use std::io::{IsTerminal, stderr, stdin};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::builder::PossibleValuesParser;
use clap::{Args, Subcommand};
use strum::VariantNames;
use tipwatch_binding::MachineFile;
use tipwatch_datasheet::{Sheet, Template, ask};

use super::exit::{Exit, Terminal, Usage};
use super::open_values;
use crate::base::output_place::OutputPlace;
use crate::base::stdout::to_stdout;
use crate::setup::first_machine::Draft;
use crate::setup::from_sheet::{self, LogOfMachine, OfLog};
use crate::setup::{check_machine, inspect};

#[derive(Debug, Args)]
pub(super) struct MachineArgs {
    #[command(subcommand)]
    command: MachineCommand,
}

#[derive(Debug, Subcommand)]
enum MachineCommand {
    /// Make URDF, machine file and picture of a machine from the numbers of its data sheet.
    New(NewArgs),
    /// List the kinds of machines.
    Templates,
    /// Print a filled-in and commented sheet of a kind of machine.
    Example {
        /// The kind of machine.
        #[arg(value_parser = templates())]
        template: String,
    },
}

#[derive(Debug, Args)]
struct NewArgs {
    /// The sheet, in TOML; without it, the numbers are asked for on the terminal.
    sheet: Option<PathBuf>,
    /// The kind of machine, without a sheet.
    #[arg(long, value_name = "NAME", conflicts_with = "sheet", value_parser = templates())]
    template: Option<String>,
    /// Output folder; existing files are never overwritten.
    #[arg(long, value_name = "DIR", default_value = "machine")]
    out: PathBuf,
    /// A log of the machine, whose signals the machine file then binds. At a terminal, what moves the loads of this log most is
    /// asked for, and a first report is written to machine-results/ in the folder.
    #[arg(long)]
    log: Option<PathBuf>,
    /// A DBC file that describes the messages of the log's CAN buses; may be given several times.
    #[arg(long, value_name = "FILE", requires = "log")]
    dbc: Vec<PathBuf>,
}

fn templates() -> PossibleValuesParser {
    PossibleValuesParser::new(Template::VARIANTS)
}

pub(super) fn run(args: &MachineArgs, terminal: Terminal) -> Result<Exit> {
    match &args.command {
        MachineCommand::New(args) => new(args, terminal),
        MachineCommand::Templates => {
            let lines = Template::VARIANTS.iter().map(|name| {
                let title = name.parse::<Template>().map_or("", Template::title);
                format!("{name:<20} {title}\n")
            });
            to_stdout(&lines.collect::<String>()).map(|()| Exit::DONE)
        }
        MachineCommand::Example { template } => {
            let template: Template = template.parse()?;
            to_stdout(template.example()).map(|()| Exit::DONE)
        }
    }
}

fn new(args: &NewArgs, terminal: Terminal) -> Result<Exit> {
    OutputPlace::require_local(&args.out)?;
    let databases = inspect::read_databases(&args.dbc, None)?;
    let log = args.log.as_deref().map(|log| LogOfMachine {
        log,
        databases: &databases,
    });
    let asks = open_values::is_asked(terminal);
    let ask = &mut |draft: &mut Draft| match asks {
        true => open_values::ask(draft),
        false => Ok(()),
    };
    let made = match &args.sheet {
        Some(path) => from_sheet::create(&read(path)?, &args.out, log, None, ask)?,
        None => from_sheet::create_from_answers(&answers(args)?, &args.out, log, ask)?,
    };
    to_stdout(&format!("{}\n", made.summary))?;
    check_machine::print(&made.check, false)?;
    for file in &made.files {
        terminal.print(&format!("wrote {}", file.display()));
    }
    match (made.of_log, log) {
        (Some(made), Some(of)) => of_log(made, of.log, args, asks, terminal),
        _ => Ok(Exit::DONE),
    }
}

/// Ends as `inspect --write-machine` does: with a first report after questions, else with the open values.
fn of_log(made: OfLog, log: &Path, args: &NewArgs, asks: bool, terminal: Terminal) -> Result<Exit> {
    open_values::tell_missing(made.missing.as_deref(), terminal);
    made.asked?;
    if !asks {
        open_values::name(&made.draft, terminal);
        return Ok(Exit::DONE);
    }
    if made.missing.is_some() {
        return Ok(Exit::DONE);
    }
    let file = MachineFile::read(&args.out.join("machine.toml"))?;
    open_values::report(log, &file, terminal)
}

fn read(path: &Path) -> Result<Sheet> {
    let text = tipwatch_binding::read_text(path)
        .with_context(|| format!("{}: cannot be read", path.display()))?;
    Ok(Sheet::from_toml(&text, &path.display().to_string())?)
}

/// Asks on the terminal.
fn answers(args: &NewArgs) -> Result<String> {
    let Some(template) = &args.template else {
        return Err(
            Usage("expected a SHEET, or --template NAME to be asked for the numbers").into(),
        );
    };
    if !stdin().is_terminal() {
        return Err(Usage("expected a SHEET, because standard input is not a terminal; `tipwatch machine example NAME` prints one to start from").into());
    }
    ask(template.parse()?, &mut stdin().lock(), &mut stderr().lock()).context("the terminal")
}
