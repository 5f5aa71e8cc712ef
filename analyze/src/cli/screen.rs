//! `tipwatch screen`.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use tipwatch_binding::MachineFile;

use super::exit::{Exit, Terminal};
use super::options::{AnalysisArgs, PolicyArgs};
use crate::base::progress::LogCount;
use crate::screen::{Fleet, Gate, Request, Screen, Shard, Update, gather, screen};

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
    /// Output folder for data set, page and reports.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of logs analysed in parallel; default: number of processors.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    jobs: Option<u32>,
    /// Limit of the estimated memory of all analyses (GiB); default: three quarters of the free memory.
    /// One log is always analysed.
    #[arg(long, value_name = "GIB", value_parser = clap::value_parser!(u32).range(1..))]
    memory: Option<u32>,
    /// Analyse the I-th of N parts of the logs, for array jobs; `--gather` combines the parts.
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<Shard>,
    /// Resume the run in DIR: skip logs already analysed with the same content, machine, options and
    /// program version. Failed logs are retried.
    #[arg(long)]
    resume: bool,
    /// Analyse nothing; build data set and page from the records in DIR.
    #[arg(long, conflicts_with_all = ["logs", "machine", "fleet", "shard", "resume", "jobs", "memory"])]
    gather: bool,
    #[command(flatten)]
    analysis: AnalysisArgs,
    #[command(flatten)]
    policy: PolicyArgs,
}

pub(super) fn run(args: &ScreenArgs, terminal: Terminal) -> Result<Exit> {
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
        Update::Note(note) => count.print(&format!("note: {note}")),
    };
    let gate = Gate {
        policy: policy.as_ref(),
        min_valid: args.policy.min_valid(policy.as_ref()),
    };
    let found = if args.gather {
        gather(&args.out, gate, &notify)?
    } else {
        let fleet = fleet(args)?;
        let jobs = args.jobs.map_or_else(processors, |jobs| jobs as usize);
        let request = Request {
            logs: &args.logs,
            out: &args.out,
            jobs,
            memory_bytes: args.memory.map(|gib| u64::from(gib) << 30),
            shard: args.shard,
            resume: args.resume,
            options: args.analysis.options(),
            stop: None,
        };
        screen(&request, &fleet, gate, &notify)?
    };
    count.finish();
    let shown = if terminal.verbose {
        usize::MAX
    } else {
        MOST_UNDECIDED
    };
    for (log, reason) in found.undecided.iter().take(shown) {
        terminal.print(&format!("not decided: {log}: {reason}"));
    }
    terminal.print(&result_line(&found));
    Ok(exit_of(&found))
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
        (Some(path), _) => Fleet::read(path),
        (None, machine) => {
            let machine = machine
                .as_deref()
                .context("expected --machine or --fleet")?;
            Ok(Fleet::of_one(MachineFile::read(machine)?))
        }
    }
}

fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn result_line(found: &Screen) -> String {
    let totals = &found.totals;
    let mut text = format!(
        "{} analysed, {} failed, {} unchanged. Total: {} logs, {} failed, {} with findings, {} with losses",
        found.analysed_now,
        found.failed_now,
        found.from_before,
        totals.logs,
        totals.failed,
        totals.with_findings,
        totals.with_losses
    );
    if totals.undecided > 0 {
        text.push_str(&format!(", {} not decided", totals.undecided));
    }
    if totals.breaking_policy > 0 {
        text.push_str(&format!(
            ", {} violating the policy",
            totals.breaking_policy
        ));
    }
    match &found.page {
        Some(page) => text.push_str(&format!("\npage: {}", page.display())),
        None => {
            text.push_str(
                "\nthis is one part of the logs; --gather builds data set and page from all parts",
            );
        }
    }
    text
}

fn exit_of(found: &Screen) -> Exit {
    let totals = &found.totals;
    Exit {
        failed: totals.failed_unaccepted > 0,
        broken: totals.breaking_by_evidence > 0,
        undecided: totals.undecided > 0,
        lost: totals.with_losses > 0,
        ..Exit::DONE
    }
}

fn shard(text: &str) -> Result<Shard, String> {
    let expected = || format!("expected I/N, such as 2/8, with I from 1 to N, found \"{text}\"");
    let (index, count) = text.split_once('/').ok_or_else(expected)?;
    let number = |part: &str| part.parse::<usize>().map_err(|_| expected());
    let (index, count) = (number(index)?, number(count)?);
    match (1..=count).contains(&index) {
        true => Ok(Shard { index, count }),
        false => Err(expected()),
    }
}
