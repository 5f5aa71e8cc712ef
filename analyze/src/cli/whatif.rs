//! `tipwatch whatif`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::exit::{Ending, Exit, Terminal};
use super::machine_file::InertiaArgs;
use super::options::{MinValidArgs, period, rate, seconds};
use crate::base::options::{Estimator, Options};
use crate::base::output_place::OutputPlace;
use crate::base::progress::Progress;
use crate::suspension::{SuspensionMode, WhatIfOptions, findings, what_if};

#[derive(Debug, Args)]
pub(super) struct WhatIfArgs {
    /// The log.
    log: PathBuf,
    /// The machine file; its [suspension] describes the actuators and their control.
    #[arg(long)]
    machine: PathBuf,
    #[command(flatten)]
    inertias: InertiaArgs,
    /// Output folder.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Suspension motion.
    #[arg(long, value_enum, default_value_t = SuspensionMode::LookAhead)]
    suspension: SuspensionMode,
    /// Control period; default: from the rate in the machine file.
    #[arg(long, value_name = "S", value_parser = period)]
    step: Option<f64>,
    /// Estimator of the states.
    #[arg(long, value_enum, default_value_t = Estimator::Smoother)]
    estimator: Estimator,
    /// Row rate; default: rows at the stamps of the fastest joint stream.
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate: Option<f64>,
    /// Start time (seconds after the first sample).
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = seconds)]
    from: Option<f64>,
    /// End time (seconds after the first sample).
    #[arg(long, value_name = "S", value_parser = seconds)]
    to: Option<f64>,
    #[command(flatten)]
    min_valid: MinValidArgs,
}

pub(super) fn run(args: &WhatIfArgs, terminal: Terminal) -> Result<Exit> {
    let file = args.inertias.read(&args.machine)?;
    let options = Options {
        estimator: args.estimator,
        rate_hz: args.rate,
        from_s: args.from,
        to_s: args.to,
        ..Options::default()
    };
    let what_if_options = WhatIfOptions {
        suspension: args.suspension,
        step_s: args.step,
    };
    let mut progress = Progress::new(&args.log, terminal.quiet);
    let replayed = what_if(&args.log, &file, options, what_if_options, &mut |bytes| {
        progress.at(bytes);
    })?;
    progress.finish();
    let target = OutputPlace::folder(&args.out)?;
    replayed.write(target.path())?;
    target.publish("summary.json")?;
    for finding in findings(&replayed) {
        terminal.print(&format!("- {finding}"));
    }
    terminal.print(&format!("results: {}", args.out.display()));
    let min_valid = args.min_valid.share(None);
    Ok(Ending::of(&replayed.analysis, min_valid).tell(terminal))
}
