//! Requests, progress and results of a run over a fleet.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::inputs::RequestedLogs;
use super::shard::Shard;
use super::totals::Totals;
use crate::base::options::Options;
use crate::policy::Policy;

/// Request of a run: what to analyse, and how.
#[derive(Debug)]
pub struct Request<'a> {
    /// Folders, patterns, manifests and logs.
    pub logs: &'a [PathBuf],
    /// The output folder.
    pub out: &'a Path,
    /// Files that are written there.
    pub output: Output,
    /// Number of logs analysed in parallel.
    pub jobs: usize,
    /// Limit of the estimated memory of all analyses (bytes); if `None`, three quarters of the free memory.
    pub memory_bytes: Option<u64>,
    /// The part of the logs to analyse.
    pub shard: Option<Shard>,
    /// Whether to resume the run in the output folder.
    pub resume: bool,
    /// Whether records of logs that no longer exist are removed.
    pub prune: bool,
    /// Which logs get a report of their own.
    pub reports: Reports,
    /// Options of each analysis.
    pub options: Options,
    /// Once it is set, no further log is begun, and the run ends with an error. It can be resumed.
    pub stop: Option<&'a AtomicBool>,
}

/// Output of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// Records and reports, and data set and page of all of them; of a shard records and reports alone.
    DataSet,
    /// Records and reports alone, in a place that many processes share and any of them may be lost.
    Records {
        /// Number of processes that may be lost while they analyse a log, before it counts as failed.
        attempts: u32,
    },
}

/// Processes that may be lost while they analyse a log, before it counts as failed, unless another number is asked for.
pub const DEFAULT_ATTEMPTS: u32 = 3;

/// Most logs analysed in parallel.
pub const MOST_JOBS: u32 = 1024;

/// Which logs of a run get a report of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Reports {
    /// None.
    None,
    /// Those with an event of a wheel or an edge, or with a load within two standard deviations of zero.
    #[default]
    Events,
    /// All.
    All,
}

/// Which records to gather, and where to.
#[derive(Debug)]
pub struct Gathering<'a> {
    /// The place of the records.
    pub records: &'a Path,
    /// The output folder; it may be the same.
    pub out: &'a Path,
    /// The logs that must have a record, if any are named: folders, patterns, manifests and logs. Those
    /// without one are in the data set as failed.
    pub logs: &'a [PathBuf],
    /// Results of the search for these logs before their analysis; if `None`, the logs are searched for.
    pub found: Option<&'a RequestedLogs>,
    /// Whether records of named logs that no longer exist are removed.
    pub prune: bool,
    /// Options, of which the failed logs name the model.
    pub options: Options,
}

/// Requirements by which the logs of a run are judged.
#[derive(Debug, Clone, Copy)]
pub struct Gate<'a> {
    /// The rules, if any.
    pub policy: Option<&'a Policy>,
    /// Least share of a log's time that must be computable.
    pub min_valid: f64,
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
        /// Reason why the log could not be analysed.
        failure: Option<&'a str>,
    },
    /// Logs that were analysed contradict each other, so that this one fails.
    Conflict {
        /// Its path.
        log: &'a str,
        /// Description of the contradiction.
        reason: &'a str,
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
    /// Of these, logs whose failure no policy accepts, whether or not the data set has an earlier result of them.
    pub unaccepted_now: usize,
    /// Logs that failed in this run because their storage did not deliver them.
    pub not_delivered: usize,
    /// Unchanged logs, analysed in an earlier run.
    pub from_before: usize,
    /// Analysed logs that decide nothing, by path, with the reason.
    pub undecided: Vec<(String, String)>,
    /// The page; `None` for a shard.
    pub page: Option<PathBuf>,
}
