//! `tipwatch whatif`.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use tipwatch_binding::MachineFile;
use tipwatch_language::{say, word};

use super::exit::{Ending, Exit, Terminal, Usage};
use super::machine_file::InertiaArgs;
use super::options::{LanguageArgs, MinValidArgs, period, rate};
use crate::base::files::write_atomically;
use crate::base::options::{Estimator, Options, seconds};
use crate::base::output_place::OutputPlace;
use crate::base::progress::Progress;
use crate::compare::{Extent, InputDifference, Side, as_text, compare, render_drawn};
use crate::suspension::{
    Suppositions, SuspensionMode, WhatIfOptions, caveats, findings, replies, suppose, what_if,
};

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
    /// Suspension motion; default: look-ahead, unless something else is supposed.
    #[arg(long, value_enum)]
    suspension: Option<SuspensionMode>,
    #[command(flatten)]
    suppositions: Suppositions,
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
    #[command(flatten)]
    language: LanguageArgs,
}

pub(super) fn run(args: &WhatIfArgs, terminal: Terminal) -> Result<Exit> {
    args.language.choose();
    let file = args.inertias.read(&args.machine)?;
    let options = Options {
        estimator: args.estimator,
        rate_hz: args.rate,
        from_s: args.from,
        to_s: args.to,
        ..Options::default()
    };
    if !args.suppositions.is_empty() {
        if args.suspension.is_some() || args.step.is_some() {
            bail!(Usage(
                "expected either --suspension and --step, or --slope-level, --speed, --payload, --joint and --split, found both"
            ));
        }
        return supposed(args, &file, options, terminal);
    }
    let what_if_options = WhatIfOptions {
        suspension: args.suspension.unwrap_or(SuspensionMode::LookAhead),
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
    terminal.print(&say!("results: {}", args.out.display()));
    let min_valid = args.min_valid.share(None);
    Ok(Ending::of(&replayed.analysis, min_valid).tell(terminal))
}

/// The log as recorded beside the log as supposed: on the terminal, and as comparison.json and comparison.html.
fn supposed(
    args: &WhatIfArgs,
    file: &MachineFile,
    options: Options,
    terminal: Terminal,
) -> Result<Exit> {
    let suppositions = &args.suppositions;
    let [recorded, supposed] = suppose(&args.log, file, options, suppositions)?;
    let a = Side::of_analysis(&recorded, word!("as recorded"))?;
    let what = suppositions.in_words(&recorded);
    let b = Side::of_analysis(&supposed, &what)?;
    let mut comparison = compare(&a, &b);
    comparison.suppose(&recorded.rows, &replies(&recorded, &supposed, suppositions));
    comparison.inputs.insert(0, InputDifference::supposed(what));
    comparison.caveats = caveats(&recorded, &supposed, suppositions);
    let target = OutputPlace::folder(&args.out)?;
    let json = serde_json::to_string_pretty(&comparison)?;
    write_atomically(&target.path().join("comparison.json"), json.as_bytes())?;
    let page = render_drawn(&comparison, [&a, &b], [&recorded, &supposed]);
    write_atomically(&target.path().join("comparison.html"), page.as_bytes())?;
    target.publish("comparison.json")?;
    let extent = match terminal.verbose {
        true => Extent::Whole,
        false => Extent::Short,
    };
    terminal.print(as_text(&comparison, extent).trim_end());
    terminal.print(&say!("results: {}", args.out.display()));
    let min_valid = args.min_valid.share(None);
    let [of_a, of_b] = [
        (&recorded, word!("of the log as recorded")),
        (&supposed, word!("of it as supposed")),
    ]
    .map(|(analysis, of)| Ending::of(analysis, min_valid).tell_of(of, terminal));
    Ok(of_a.and(of_b))
}
