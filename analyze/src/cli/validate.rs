//! `tipwatch validate`.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;

use super::exit::{Exit, Terminal};
use super::machine_file::InertiaArgs;
use crate::base::number::count_of;
use crate::base::options::Estimator;
use crate::base::output_place::OutputPlace;
use crate::base::stdout::print;
use crate::setup::validate::{page, text, validate};

#[derive(Debug, Args)]
pub(super) struct ValidateArgs {
    /// The logs, which must contain measured loads.
    #[arg(required = true)]
    logs: Vec<PathBuf>,
    /// The machine file, which binds the measured loads: [signals.wheels.NAME] or [[signals.load_sums]].
    #[arg(long)]
    machine: PathBuf,
    #[command(flatten)]
    inertias: InertiaArgs,
    /// The URDF, for a machine file that names none; otherwise that of the log is used.
    #[arg(long)]
    urdf: Option<PathBuf>,
    /// Write a page with the loads over time to this file.
    #[arg(long, value_name = "FILE.html")]
    out: Option<PathBuf>,
    /// Estimator of the states: what a live monitor computes is causal.
    #[arg(long, value_enum, default_value_t = Estimator::Smoother)]
    estimator: Estimator,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &ValidateArgs, terminal: Terminal) -> Result<Exit> {
    let file = (args.inertias).read_with_urdf(&args.machine, args.urdf.as_deref())?;
    let found = validate(&file, &args.logs, args.estimator)?;
    print(&found, args.json, |found| Ok(text(found)))?;
    if let Some(out) = &args.out {
        let target = OutputPlace::file(out, false)?;
        std::fs::write(target.path(), page(&found))
            .with_context(|| format!("{}: cannot be written", out.display()))?;
        target.publish("")?;
        terminal.print(&format!("page: {}", out.display()));
    }
    let damaged = found.logs.iter().filter(|log| log.has_losses).count();
    if damaged > 0 {
        terminal.verdict(&format!(
            "lost: data of {damaged} of {} was lost",
            count_of(found.logs.len(), "log")
        ));
    }
    Ok(Exit {
        broken: found.is_contradicted(),
        undecided: !found.has_compared(),
        lost: damaged > 0,
        ..Exit::DONE
    })
}
