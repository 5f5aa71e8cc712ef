//! `tipwatch-live monitor`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Args;
use tipwatch_binding::{NOT_COMMISSIONED, commissioning_of};

use super::arguments::{LoopArgs, MachineArgs, ServiceArgs};
use crate::alarm::default_folder;
use crate::monitor::output::Format;
use crate::monitor::{MonitorOptions, MonitorProgram, ProgramObserver};
use crate::node::{Housekeeping, LiveNode};
use crate::system::clock::Monotonic;
use crate::wire::fingerprint::Fingerprint;
use crate::wire::opening::Untimed;

#[derive(Debug, Args)]
pub(super) struct MonitorArgs {
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    service: ServiceArgs,
    /// Print every row as one line of JSON.
    #[arg(long, conflicts_with = "quiet")]
    json: bool,
    /// Print only changes of the level.
    #[arg(long, conflicts_with_all = ["quiet", "json"])]
    changes: bool,
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

pub(super) fn run_monitor(args: &MonitorArgs) -> Result<ExitCode> {
    let real_time = args.running.real_time()?;
    let mut file = args.machine.read()?;
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
        running: args.running.options(),
        untimed: if args.allow_untimed {
            Untimed::Allowed
        } else {
            Untimed::Refused
        },
        state: &state,
    };
    let format = match (args.json, args.changes) {
        (true, _) => Format::Json,
        (_, true) => Format::Changes,
        _ => Format::Text,
    };
    let mut observer = ProgramObserver::start(
        (!args.quiet).then_some(format),
        Housekeeping::start(&address)?,
    )?;
    let mut monitor = MonitorProgram::new(&node, &file, &urdf, &Monotonic, options)?
        .with_fingerprint(&fingerprint)
        .with_commissioning(commissioning.as_ref().map(|(_, found)| found));
    real_time.apply()?;
    let ran = monitor.run(&mut observer);
    let unprinted = observer.finish()?;
    let counts = ran?;
    eprintln!(
        "monitor: {} rows; samples: {} lost, {} refused, {} repeated, {} sent before joining",
        counts.rows, counts.lost, counts.refused, counts.repeated, counts.before_joining
    );
    monitor.tell_untested();
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
