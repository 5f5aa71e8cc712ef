//! `tipwatch screen`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use tipwatch_language::{say, word};

use super::exit::{Exit, Terminal, Usage};
use super::machine_file::InertiaArgs;
use super::options::{AnalysisArgs, LanguageArgs, PolicyArgs};
use crate::base::number::logs;
use crate::base::progress::LogCount;
use crate::screen::{
    DEFAULT_ATTEMPTS, Fleet, Gate, Gathering, MOST_JOBS, Output, Reports, Request, Screen, Shard,
    Update, gather, screen,
};

/// Logs that decide nothing, printed one by one; more with `--verbose`.
const MOST_UNDECIDED: usize = 20;

#[derive(Debug, Args)]
pub(super) struct ScreenArgs {
    /// Folders, patterns ("logs/**/*.mcap"), manifests (.txt, .list, .manifest: one log a line) and logs.
    #[arg(required_unless_present = "gather")]
    logs: Vec<PathBuf>,
    /// The machine file for all logs.
    #[arg(long, required_unless_present_any = ["fleet", "gather"], conflicts_with = "fleet")]
    machine: Option<PathBuf>,
    /// The fleet file: rules that assign machine files to logs.
    #[arg(long)]
    fleet: Option<PathBuf>,
    #[command(flatten)]
    inertias: InertiaArgs,
    /// Output folder for data set, page and reports.
    #[arg(long, value_name = "DIR", required_unless_present = "records")]
    out: Option<PathBuf>,
    /// Write records and reports alone, into a folder that many processes share; exit with 0 when every log
    /// has its record, whatever it says. Logs that have a record are skipped. `--gather PLACE` makes the
    /// data set.
    #[arg(long, value_name = "PLACE", conflicts_with_all = ["out", "gather", "resume"])]
    records: Option<PathBuf>,
    /// With `--records`: number of processes that may be lost while they analyse a log, before it counts as
    /// failed.
    #[arg(long, value_name = "N", default_value_t = DEFAULT_ATTEMPTS, conflicts_with_all = ["out", "gather"],
          value_parser = clap::value_parser!(u32).range(1..))]
    attempts: u32,
    /// Number of logs analysed in parallel; default: number of processors.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_JOBS)))]
    jobs: Option<u32>,
    /// Limit of the estimated memory of all analyses (GiB); default: three quarters of the free memory.
    /// One log is always analysed.
    #[arg(long, value_name = "GIB", value_parser = clap::value_parser!(u32).range(1..))]
    memory: Option<u32>,
    /// Analyse the I-th of N parts of the logs, for array jobs; `--gather` combines the parts. `auto/N`
    /// takes the index from the variables of Kubernetes, AWS Batch, Slurm, Google Batch or Cloud Run
    /// (counted from 0); `auto` the number of parts, too, where the engine tells it.
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<Shard>,
    /// Resume the run in DIR: skip logs already analysed with the same content, machine, options and
    /// program version. Failed logs are retried.
    #[arg(long)]
    resume: bool,
    /// Remove logs that no longer exist from the data set; without it they stay, and are told. With `--gather` the logs must
    /// be named.
    #[arg(long, conflicts_with_all = ["records", "shard"])]
    prune: bool,
    /// Which logs get a report of their own: those with events of wheels or edges, all, or none.
    #[arg(long, value_enum, default_value_t)]
    reports: Reports,
    /// Analyse nothing; build data set and page from the records in PLACE (default: DIR). If logs are named,
    /// those without a record are in the data set as failed.
    #[arg(long, value_name = "PLACE", num_args = 0..=1,
          conflicts_with_all = ["machine", "fleet", "shard", "resume", "jobs", "memory"])]
    gather: Option<Option<PathBuf>>,
    #[command(flatten)]
    analysis: AnalysisArgs,
    #[command(flatten)]
    policy: PolicyArgs,
    #[command(flatten)]
    language: LanguageArgs,
}

pub(super) fn run(args: &ScreenArgs, terminal: Terminal) -> Result<Exit> {
    if args.prune && args.logs.is_empty() {
        bail!(Usage(
            "--prune: expected the folders or logs of the fleet, found none; without them nobody looks for logs that no longer exist"
        ));
    }
    args.language.choose();
    tipwatch_allocator::keep_between_tasks();
    let policy = args.policy.policy()?;
    let count = LogCount::new(terminal.quiet);
    let notify = |update: Update<'_>| match update {
        Update::Begin(logs) => count.begin(logs),
        Update::Done { log, failure } => {
            if let Some(reason) = failure {
                count.error(&failed(log, reason));
            } else if terminal.verbose {
                count.print(&format!("done: {log}"));
            }
            count.next();
        }
        Update::Conflict { log, reason } => count.error(&failed(log, reason)),
        Update::Note(note) => count.print(&format!("note: {note}")),
    };
    let gate = Gate {
        policy: policy.as_ref(),
        min_valid: args.policy.min_valid(policy.as_ref()),
    };
    let (found, is_for_gathering) = match (&args.gather, &args.records, &args.out) {
        (Some(records), _, Some(out)) => {
            let asked = Gathering {
                records: records.as_ref().unwrap_or(out),
                out,
                logs: &args.logs,
                found: None,
                prune: args.prune,
                options: args.analysis.options(),
            };
            (gather(&asked, gate, &notify)?, false)
        }
        (None, Some(records), _) => {
            let attempts = args.attempts;
            let found = analyse(args, records, Output::Records { attempts }, gate, &notify)?;
            (found, true)
        }
        (None, None, Some(out)) => (analyse(args, out, Output::DataSet, gate, &notify)?, false),
        (_, _, None) => bail!("expected --out or --records"),
    };
    count.finish();
    let shown = if terminal.verbose {
        usize::MAX
    } else {
        MOST_UNDECIDED
    };
    for (log, reason) in found.undecided.iter().take(shown) {
        terminal.print(&say!("not decided: {log}: {reason}"));
    }
    terminal.print(&result_line(&found));
    // whether a log failed is the verdict of the gathered data set, not of the process that wrote its record
    let nothing_was_delivered = found.not_delivered > 0
        && found.not_delivered == found.analysed_now + found.failed_now + found.from_before;
    Ok(if is_for_gathering && nothing_was_delivered {
        Exit::FAILED
    } else if is_for_gathering {
        Exit::DONE
    } else {
        exit_of(&found)
    })
}

fn analyse(
    args: &ScreenArgs,
    out: &Path,
    output: Output,
    gate: Gate<'_>,
    notify: &(dyn Fn(Update<'_>) + Sync),
) -> Result<Screen> {
    let fleet = fleet(args)?;
    let jobs = args.jobs.map_or_else(processors, |jobs| jobs as usize);
    let request = Request {
        logs: &args.logs,
        out,
        output,
        jobs,
        memory_bytes: args.memory.map(|gib| u64::from(gib) << 30),
        shard: args.shard,
        resume: args.resume,
        prune: args.prune,
        reports: args.reports,
        options: args.analysis.options(),
        stop: None,
    };
    screen(&request, &fleet, gate, notify)
}

/// Names the log unless the reason does.
fn failed(log: &str, reason: &str) -> String {
    match reason.contains(log) {
        true => format!("failed: {reason}"),
        false => format!("failed: {log}: {reason}"),
    }
}

fn fleet(args: &ScreenArgs) -> Result<Fleet> {
    match (&args.fleet, &args.machine) {
        (Some(path), _) => Fleet::read(path)?.with_machines(|file| args.inertias.applied(file)),
        (None, machine) => {
            let machine = machine
                .as_deref()
                .context("expected --machine or --fleet")?;
            Ok(Fleet::of_one(args.inertias.read(machine)?))
        }
    }
}

fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn result_line(found: &Screen) -> String {
    let totals = &found.totals;
    let mut text = say!(
        "{} analysed, {} failed, {} unchanged. Total: {}, {} failed, {} with findings, {} with losses",
        found.analysed_now,
        found.failed_now,
        found.from_before,
        logs(totals.logs),
        totals.failed,
        totals.with_findings,
        totals.with_losses
    );
    if totals.undecided > 0 {
        text.push_str(&say!(", {} not decided", totals.undecided));
    }
    if totals.breaking_policy > 0 {
        text.push_str(&say!(", {} violating the policy", totals.breaking_policy));
    }
    match &found.page {
        Some(page) => {
            text.push('\n');
            text.push_str(&say!("page: {}", page.display()));
        }
        None => {
            text.push('\n');
            text.push_str(word!(
                "records only; --gather builds data set and page from all of them"
            ));
        }
    }
    text
}

fn exit_of(found: &Screen) -> Exit {
    let totals = &found.totals;
    Exit {
        failed: totals.failed_unaccepted > 0 || found.unaccepted_now > 0,
        broken: totals.breaking_by_evidence > 0,
        undecided: totals.undecided > 0,
        lost: totals.with_losses > 0,
        ..Exit::DONE
    }
}

fn shard(text: &str) -> Result<Shard, String> {
    Shard::read(text, |name| std::env::var(name).ok()).map_err(|error| format!("{error:#}"))
}
