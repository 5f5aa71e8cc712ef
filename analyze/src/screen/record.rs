//! The record of a finished log: one small document, written atomically.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::policy::facts::{EventFacts, LogFacts};

/// Version of the document.
pub(super) const RECORD_SCHEMA: u32 = 2;

/// A finished log: analysed or failed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    /// Version of this document's keys.
    pub(super) schema: u32,
    /// Absolute path of the log.
    pub(super) path: String,
    /// SHA-256 of its content; `None` if it cannot be read.
    pub(super) log_id: Option<String>,
    /// Length of its files (bytes).
    pub(super) bytes: Option<u64>,
    /// The machine; `None` if unknown.
    pub(super) machine: Option<MachineName>,
    /// See [`super::version`]; `None` without a machine.
    pub(super) analysis_version: Option<String>,
    /// Version of the program.
    pub(super) tipwatch_version: String,
    /// Name of the model.
    pub(super) model: String,
    /// The result.
    pub(super) result: Outcome,
}

/// The machine that a log was analysed with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct MachineName {
    /// Its name.
    pub(super) name: String,
    /// SHA-256 of its machine file.
    pub(super) sha256: String,
}

/// The result of a log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub(super) enum Outcome {
    /// The log was analysed.
    Analysed {
        /// Its facts.
        facts: Box<LogFacts>,
        /// Its events.
        events: Vec<EventFacts>,
        /// Whether a report was written.
        has_report: bool,
    },
    /// The log could not be analysed.
    Failed {
        /// The reason.
        reason: String,
    },
}

impl Record {
    /// Folder of the report within the output folder; `None` without a report.
    pub(super) fn report_folder(&self) -> Option<String> {
        let Outcome::Analysed {
            has_report: true, ..
        } = &self.result
        else {
            return None;
        };
        self.log_id.as_deref().map(report_folder)
    }

    pub(super) fn is_failed(&self) -> bool {
        matches!(self.result, Outcome::Failed { .. })
    }

    /// The facts and events; `None` for a failed log.
    pub(super) fn analysed(&self) -> Option<(&LogFacts, &[EventFacts])> {
        match &self.result {
            Outcome::Analysed { facts, events, .. } => Some((facts, events)),
            Outcome::Failed { .. } => None,
        }
    }

    /// Name of the log's file or folder.
    pub(super) fn name(&self) -> String {
        let name = Path::new(&self.path).file_name();
        name.map_or(self.path.clone(), |name| name.to_string_lossy().into())
    }

    /// The day of its first row, UTC, such as `2026-06-01`; `None` if its stamps are not dates.
    pub(super) fn day(&self) -> Option<String> {
        /// 1990-01-01 and 2100-01-01: stamps outside have another epoch.
        const DATES_NS: std::ops::Range<i64> = 631_152_000_000_000_000..4_102_444_800_000_000_000;
        let (facts, _) = self.analysed()?;
        let start = Some(facts.start_ns).filter(|start| DATES_NS.contains(start))?;
        let stamp = jiff::Timestamp::from_nanosecond(start.into()).ok()?;
        Some(stamp.strftime("%Y-%m-%d").to_string())
    }
}

/// Folder of a log's report within the output folder.
pub(super) fn report_folder(log_id: &str) -> String {
    format!("reports/{}", log_id.get(..16).unwrap_or(log_id))
}
