//! What a run over a fleet is asked for, reports and returns.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::totals::Totals;
use crate::base::options::Options;
use crate::policy::Policy;

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
    /// Once it is set, no further log is begun, and the run ends with an error. It can be resumed.
    pub stop: Option<&'a AtomicBool>,
}

/// One part of the logs, for one of several processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Number of the part, from 1.
    pub index: usize,
    /// Number of parts.
    pub count: usize,
}

/// How the logs of a run are judged.
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
    /// Analysed logs that decide nothing, by path, with the reason.
    pub undecided: Vec<(String, String)>,
    /// The page; `None` for a shard.
    pub page: Option<PathBuf>,
}
