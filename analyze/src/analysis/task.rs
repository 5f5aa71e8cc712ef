//! Task of an analysis.

use std::path::Path;
use std::sync::Arc;

use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;

use super::Analysis;
use super::advice::Hypothesis;
use crate::base::options::Options;

/// A log to analyse, and how.
pub(super) struct Task<'a> {
    pub(super) path: &'a Path,
    pub(super) file: &'a MachineFile,
    pub(super) log: Arc<Log>,
    pub(super) options: Options,
    /// Whether the whole table is kept.
    pub(super) is_kept: bool,
    /// Hypotheses that replace recorded quantities, with the analysis of the log as recorded; `None` in that analysis itself.
    pub(super) supposed: Option<(&'a [Hypothesis], &'a Analysis)>,
}

impl Task<'_> {
    /// Whether the analysis is of the log as recorded, without hypotheses.
    pub(super) fn is_recorded(&self) -> bool {
        self.supposed.is_none()
    }
}
