//! `tipwatch compare`.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::Args;
use tipwatch_language::say;

use super::exit::{Exit, Terminal, Usage};
use super::machine_file::InertiaArgs;
use super::options::{AnalysisArgs, LanguageArgs, MinValidArgs};
use crate::base::files::write_atomically;
use crate::base::options::{Estimator, ModelKind, Options};
use crate::base::output_place::OutputPlace;
use crate::base::stdout::to_stdout;
use crate::compare::{Extent, Side, as_text, compare, render};

#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    /// A log, or an output folder of `analyze`.
    a: PathBuf,
    /// Another log or output folder; if missing, A is compared with itself under --machine-b, --model-b
    /// or --estimator-b.
    b: Option<PathBuf>,
    /// The machine file for logs.
    #[arg(long)]
    machine: Option<PathBuf>,
    /// Another machine file for B.
    #[arg(long, value_name = "MACHINE")]
    machine_b: Option<PathBuf>,
    #[command(flatten)]
    inertias: InertiaArgs,
    #[command(flatten)]
    analysis: AnalysisArgs,
    /// Another model for B.
    #[arg(long, value_enum, value_name = "MODEL")]
    model_b: Option<ModelKind>,
    /// Another estimator for B.
    #[arg(long, value_enum, value_name = "ESTIMATOR")]
    estimator_b: Option<Estimator>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Write comparison.json and comparison.html into DIR.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    min_valid: MinValidArgs,
    #[command(flatten)]
    language: LanguageArgs,
}

pub(super) fn run(args: &CompareArgs, terminal: Terminal) -> Result<Exit> {
    args.language.choose();
    let options = args.analysis.options();
    let other = args.machine_b.is_some() || args.model_b.is_some() || args.estimator_b.is_some();
    if args.b.is_none() && !other {
        bail!(Usage(
            "expected a second log or output folder, or --machine-b, --model-b or --estimator-b"
        ));
    }
    let options_b = Options {
        model: args.model_b.unwrap_or(options.model),
        estimator: args.estimator_b.unwrap_or(options.estimator),
        ..options
    };
    let path_b = args.b.as_deref().unwrap_or(&args.a);
    let machine_b = args.machine_b.as_deref().or(args.machine.as_deref());
    if other && Side::is_folder(path_b) {
        bail!(Usage(
            "--machine-b, --model-b and --estimator-b apply to logs, not to output folders"
        ));
    }
    let read = |path: Option<&Path>| path.map(|path| args.inertias.read(path)).transpose();
    let a = Side::of(&args.a, read(args.machine.as_deref())?.as_ref(), options)?;
    let b = Side::of(path_b, read(machine_b)?.as_ref(), options_b)?;
    let comparison = compare(&a, &b);
    let json = serde_json::to_string_pretty(&comparison)?;
    match args.json {
        true => to_stdout(&format!("{json}\n"))?,
        false => {
            let extent = match terminal.verbose {
                true => Extent::Whole,
                false => Extent::Usual,
            };
            to_stdout(&as_text(&comparison, extent))?;
        }
    }
    if let Some(out) = &args.out {
        let target = OutputPlace::folder(out)?;
        write_atomically(&target.path().join("comparison.json"), json.as_bytes())?;
        let page = target.path().join("comparison.html");
        write_atomically(&page, render(&comparison, &a, &b).as_bytes())?;
        target.publish("comparison.json")?;
        terminal.print(&say!("page: {}", out.join("comparison.html").display()));
    }
    let min_valid = args.min_valid.share(None);
    let mut exit = Exit::DONE;
    for side in [&a, &b] {
        if side.has_losses() {
            terminal.verdict(&say!("lost: {}: data of its log was lost", side.name()));
            exit.lost = true;
        }
        if let Some(reason) = side.undecided(min_valid) {
            terminal.verdict(&say!("not decided: {}: {reason}", side.name()));
            exit.undecided = true;
        }
    }
    Ok(exit)
}
