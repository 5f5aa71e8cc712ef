//! `tipwatch analyze`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::{Args, CommandFactory};
use tipwatch_binding::MachineFile;

use super::{Cli, Verdict, Voice, verdict};
use crate::analysis::Analysis;
use crate::events::EventKind;
use crate::imu_check::FAULT;
use crate::options::{
    ApplyClockOffsets, ClosedFormInput, ColumnGroup, Estimator, Model, MoreColumns, Options,
};
use crate::output::Outputs;
use crate::progress::Progress;
use crate::{output, report, run};

#[derive(Debug, Args)]
pub(super) struct AnalyzeArgs {
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
    /// Which offsets between the topics' clocks are taken out.
    #[arg(long, value_enum, value_name = "WHICH", default_value_t = ApplyClockOffsets::Stated)]
    apply_clock_offsets: ApplyClockOffsets,
    /// Which files to write.
    #[arg(long, value_enum, default_value_t = Outputs::All)]
    outputs: Outputs,
    /// End with exit code 4 if there is such an event; may be repeated.
    #[arg(long, value_name = "EVENT", value_enum)]
    fail_on: Vec<EventKind>,
}

fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number".to_string())?;
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err("expected a positive number".into())
    }
}

pub(super) fn run(args: &AnalyzeArgs, voice: Voice) -> Result<Verdict> {
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
        apply_clock_offsets: args.apply_clock_offsets,
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
