//! Analyses the logs of a fleet in parallel, and builds a data set and a page from them.
//!
//! ```text
//!     inputs -> workers: one_log -> store (state/) -> merge -> data_set (logs/, events/), page (fleet.html)
//! ```
//! `store` is the single source: one record per finished log, written atomically. Everything else is
//! built from all records at the end. A run may therefore be killed at any time, resumed, or split over
//! many processes, without losing a log or counting it twice.

mod data_set;
mod fleet_file;
mod identity;
mod inputs;
mod merge;
mod one_log;
mod page;
mod record;
mod store;
mod totals;
mod version;
mod workers;

use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use anyhow::{Context, Result, bail};
use serde::Serialize;

use self::merge::{LogRow, merge};
use self::one_log::{Now, Screened, Screening, write_plot_library};
use self::record::Outcome;
use self::store::Store;
use crate::base::files::{remove_unfinished, write_atomically};
use crate::base::options::Options;
use crate::policy::{Judgement, Policy};

pub use fleet_file::Fleet;
pub use totals::Totals;

/// What to analyse, and how.
#[derive(Debug)]
pub struct Request<'a> {
    /// Folders, patterns, manifests and logs.
    pub logs: &'a [PathBuf],
    /// The output folder.
    pub out: &'a Path,
    /// Number of logs analysed in parallel.
    pub jobs: usize,
    /// Limit of the estimated memory of all analyses (bytes); if `None`, three quarters of the free memory.
    pub memory_bytes: Option<u64>,
    /// The part of the logs to analyse.
    pub shard: Option<Shard>,
    /// Whether to resume the run in the output folder.
    pub resume: bool,
    /// Options of each analysis.
    pub options: Options,
}

/// One part of the logs, for one of several processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Number of the part, from 1.
    pub index: usize,
    /// Number of parts.
    pub count: usize,
}

/// Progress of a run.
#[derive(Debug)]
pub enum Update<'a> {
    /// Start, with the number of logs.
    Begin(usize),
    /// A log is finished.
    Done {
        /// Its path.
        log: &'a str,
        /// Why it could not be analysed.
        failure: Option<&'a str>,
    },
    /// A note for the user.
    Note(String),
}

/// Result of a run.
#[derive(Debug, Clone)]
pub struct Screen {
    /// Counts over the whole data set; for a shard, over its own logs.
    pub totals: Totals,
    /// Logs analysed in this run.
    pub analysed_now: usize,
    /// Logs that failed in this run.
    pub failed_now: usize,
    /// Unchanged logs, analysed in an earlier run.
    pub from_before: usize,
    /// The page; `None` for a shard.
    pub page: Option<PathBuf>,
}

/// A log that violates the policy, in `policy.json`.
#[derive(Debug, Clone, Serialize)]
struct Broken<'a> {
    path: &'a str,
    log_id: Option<&'a str>,
    broken: Vec<&'a crate::policy::RuleOutcome>,
}

/// `policy.json`.
#[derive(Debug, Serialize)]
struct PolicyResult<'a> {
    policy: &'a str,
    policy_sha256: Option<&'a str>,
    passed: bool,
    logs_judged: usize,
    logs_broken: usize,
    logs: Vec<Broken<'a>>,
}

/// Analyses the logs of a fleet. The workers call `tell`.
///
/// # Errors
/// There is no log, the output folder cannot be used, or it holds an earlier run that is not resumed. A
/// log that cannot be analysed is not an error: the data set contains it with the reason.
pub fn screen(
    request: &Request<'_>,
    fleet: &Fleet,
    policy: Option<&Policy>,
    tell: &(dyn Fn(Update<'_>) + Sync),
) -> Result<Screen> {
    let logs = of_shard(inputs::find(request.logs, request.out)?, request.shard);
    let store = Store::in_folder(request.out)?;
    let _lock = lock(request.out, request.shard.is_some())?;
    let (records, unusable) = store.load()?;
    if !records.is_empty() && !request.resume && request.shard.is_none() {
        bail!(
            "{}: expected an empty folder, found {} logs of an earlier run; use --resume to continue it",
            request.out.display(),
            records.len()
        );
    }
    unusable
        .into_iter()
        .for_each(|word| tell(Update::Note(word)));
    if request.shard.is_none() {
        store.tidy();
        remove_unfinished(request.out);
        let reports = request.out.join("reports");
        remove_unfinished(&reports);
        for report in fs::read_dir(&reports).into_iter().flatten().flatten() {
            remove_unfinished(&report.path());
        }
    }
    write_plot_library(request.out)?;
    let done = records.into_iter().filter(|_| request.resume);
    let screening = Screening {
        fleet,
        options: request.options,
        out: request.out,
        now: Now::default(),
        done_before: done
            .filter_map(|record| Some((record.log_id.clone()?, record)))
            .collect(),
    };
    tell(Update::Begin(logs.len()));
    let finished: Mutex<Vec<Screened>> = Mutex::new(Vec::new());
    workers::for_each_log(&logs, request.jobs, request.memory_bytes, |log| {
        let screened = screening.screen(log);
        store.save(&screened.record)?;
        let failure = match &screened.record.result {
            Outcome::Failed { reason } => Some(reason.as_str()),
            Outcome::Analysed { .. } => None,
        };
        tell(Update::Done {
            log: &screened.record.path,
            failure,
        });
        if let Ok(mut finished) = finished.lock() {
            finished.push(screened);
        }
        Ok(())
    })?;
    let finished = finished.into_inner().unwrap_or_default();
    let from_before = finished.iter().filter(|log| log.is_from_before).count();
    let failed_now = finished.iter().filter(|log| log.record.is_failed()).count();
    let analysed_now = finished.len() - from_before - failed_now;
    let (totals, page) = match request.shard {
        Some(_) => {
            let mut own: Vec<_> = finished.into_iter().map(|log| log.record).collect();
            own.sort_by(|a, b| a.path.cmp(&b.path));
            let rows = merge(own);
            (Totals::of(&rows, &judge(&rows, policy)), None)
        }
        None => finish(&store, request.out, policy)?,
    };
    Ok(Screen {
        totals,
        analysed_now,
        failed_now,
        from_before,
        page,
    })
}

/// Builds data set and page from the records of shards, without reading any log.
///
/// # Errors
/// The folder holds no records, or cannot be written.
pub fn gather(
    out: &Path,
    policy: Option<&Policy>,
    tell: &(dyn Fn(Update<'_>) + Sync),
) -> Result<Screen> {
    if !out.join("state").is_dir() {
        bail!(
            "{}: expected the output folder of an earlier run, found none",
            out.display()
        );
    }
    let store = Store::in_folder(out)?;
    let _lock = lock(out, false)?;
    let (_, unusable) = store.load()?;
    unusable
        .into_iter()
        .for_each(|word| tell(Update::Note(word)));
    let (totals, page) = finish(&store, out, policy)?;
    Ok(Screen {
        from_before: totals.logs,
        totals,
        analysed_now: 0,
        failed_now: 0,
        page,
    })
}

/// Builds everything from the records.
fn finish(store: &Store, out: &Path, policy: Option<&Policy>) -> Result<(Totals, Option<PathBuf>)> {
    // written again when the data set is complete
    let totals_path = out.join("screen.json");
    if totals_path.exists() {
        fs::remove_file(&totals_path)
            .with_context(|| format!("{}: cannot be removed", totals_path.display()))?;
    }
    let rows = merge(store.load()?.0);
    data_set::write(&rows, out)?;
    let judgements = judge(&rows, policy);
    write_policy(&rows, &judgements, policy, out)?;
    let totals = Totals::of(&rows, &judgements);
    let page = out.join("fleet.html");
    let html = page::render(&rows, &judgements, &totals);
    write_atomically(&page, html.as_bytes())?;
    let text = serde_json::to_string_pretty(&totals)?;
    write_atomically(&totals_path, text.as_bytes())?;
    Ok((totals, Some(page)))
}

/// The judgement of each row; `None` without a policy, and for failed logs.
fn judge(rows: &[LogRow], policy: Option<&Policy>) -> Vec<Option<Judgement>> {
    let judged = rows.iter().map(|row| {
        let (facts, events) = row.record.analysed()?;
        Some(policy?.judge(facts, events))
    });
    judged.collect()
}

fn write_policy(
    rows: &[LogRow],
    judgements: &[Option<Judgement>],
    policy: Option<&Policy>,
    out: &Path,
) -> Result<()> {
    let path = out.join("policy.json");
    let Some(policy) = policy else {
        // a file of an earlier run does not apply to this one
        let _ = fs::remove_file(path);
        return Ok(());
    };
    let judged = rows.iter().zip(judgements);
    let judged = judged.filter_map(|(row, judgement)| Some((row, judgement.as_ref()?)));
    let broken: Vec<Broken<'_>> = judged
        .clone()
        .filter(|(_, judgement)| !judgement.passed)
        .map(|(row, judgement)| Broken {
            path: &row.record.path,
            log_id: row.record.log_id.as_deref(),
            broken: judgement.broken().collect(),
        })
        .collect();
    let result = PolicyResult {
        policy: &policy.name,
        policy_sha256: policy.file.as_ref().map(|file| file.sha256.as_str()),
        passed: broken.is_empty(),
        logs_judged: judged.count(),
        logs_broken: broken.len(),
        logs: broken,
    };
    write_atomically(&path, serde_json::to_string_pretty(&result)?.as_bytes())
}

/// Every n-th log by path: all processes see the same list.
fn of_shard(logs: Vec<PathBuf>, shard: Option<Shard>) -> Vec<PathBuf> {
    let Some(shard) = shard else {
        return logs;
    };
    let own = logs.into_iter().skip(shard.index - 1);
    own.step_by(shard.count).collect()
}

/// Locks the output folder until dropped; shards share the lock among themselves.
fn lock(out: &Path, is_shard: bool) -> Result<File> {
    let path = out.join("state").join("lock");
    let file = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .open(&path)
        .with_context(|| format!("{}: cannot be created", path.display()))?;
    let locked = match is_shard {
        true => file.try_lock_shared(),
        false => file.try_lock(),
    };
    match locked {
        Err(TryLockError::WouldBlock) => bail!(
            "{}: another run writes to this folder; wait for it, or split the logs with --shard",
            out.display()
        ),
        // a file system without locks: the user must avoid concurrent runs
        Err(TryLockError::Error(_)) | Ok(()) => Ok(file),
    }
}
