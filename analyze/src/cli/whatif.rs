//! `tipwatch whatif`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tipwatch_binding::MachineFile;

use super::exit::{Exit, Voice};
use super::options::positive;
use crate::base::options::{Estimator, Options};
use crate::base::progress::Progress;
use crate::suspension::{SuspensionMode, WhatIfOptions, findings, what_if};

#[derive(Debug, Args)]
pub(super) struct WhatIfArgs {
    /// The log.
    log: PathBuf,
    /// The machine file; its [suspension] describes the actuators and their control.
    #[arg(long)]
    machine: PathBuf,
    /// Output folder.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Suspension motion.
    #[arg(long, value_enum, default_value_t = SuspensionMode::LookAhead)]
    suspension: SuspensionMode,
    /// Control period; default: from the rate in the machine file.
    #[arg(long, value_name = "S", value_parser = positive)]
    step: Option<f64>,
    /// Estimator of the states.
    #[arg(long, value_enum, default_value_t = Estimator::Smoother)]
    estimator: Estimator,
    /// Row rate; default: rows at the stamps of the fastest joint stream.
    #[arg(long, value_name = "HZ", value_parser = positive)]
    rate: Option<f64>,
    /// Start time (seconds after the first sample).
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    from: Option<f64>,
    /// End time (seconds after the first sample).
    #[arg(long, value_name = "S")]
    to: Option<f64>,
}

pub(super) fn run(args: &WhatIfArgs, voice: Voice) -> Result<Exit> {
    let file = MachineFile::read(&args.machine)?;
    let options = Options {
        estimator: args.estimator,
        rate_hz: args.rate,
        from_s: args.from,
        to_s: args.to,
        ..Options::default()
    };
    let asked = WhatIfOptions {
        suspension: args.suspension,
        step_s: args.step,
    };
    let mut progress = Progress::new(&args.log, voice.quiet);
    let replayed = what_if(&args.log, &file, options, asked, &mut |bytes| {
        progress.at(bytes);
    })?;
    progress.finish();
    replayed.write(&args.out)?;
    for finding in findings(&replayed) {
        voice.say(&format!("- {finding}"));
    }
    voice.say(&format!("results: {}", args.out.display()));
    Ok(if replayed.analysis.losses.is_empty() {
        Exit::Done
    } else {
        Exit::Lost
    })
}
