//! What is to be analysed.

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
    /// What is supposed of it instead of what was recorded, and the analysis of that, if anything is.
    pub(super) supposed: Option<(&'a [Hypothesis], &'a Analysis)>,
}

impl Task<'_> {
    /// Whether the analysis is of what was recorded, with nothing supposed.
    pub(super) fn is_recorded(&self) -> bool {
        self.supposed.is_none()
    }
}
