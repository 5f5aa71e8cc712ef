//! Totals of a run: `screen.json`, written last. If it exists, data set and page are complete.

use serde::Serialize;

use super::data_set::DATA_SET_SCHEMA;
use super::merge::LogRow;
use crate::policy::Judgement;

/// Counts over the logs of a data set.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Totals {
    /// Version of the data set's columns and of this document.
    pub schema: u32,
    /// Logs of different content, including unreadable ones.
    pub logs: usize,
    /// Paths with the same content as another.
    pub copies: u64,
    /// Analysed logs.
    pub analysed: usize,
    /// Failed logs.
    pub failed: usize,
    /// Logs with losses.
    pub with_losses: usize,
    /// Logs with a report.
    pub with_findings: usize,
    /// Logs that violate the policy.
    pub breaking_policy: usize,
    /// Total duration of the analysed logs (s).
    pub duration_s: f64,
}

impl Totals {
    pub(super) fn of(rows: &[LogRow], judgements: &[Option<Judgement>]) -> Self {
        let facts = || rows.iter().filter_map(|row| Some(row.record.analysed()?.0));
        let lost = facts().filter(|facts| {
            facts.lost_ranges + facts.missing_messages + facts.undecodable_messages > 0
        });
        let reports = rows
            .iter()
            .filter(|row| row.record.report_folder().is_some());
        let broken = judgements
            .iter()
            .flatten()
            .filter(|judgement| !judgement.passed);
        Self {
            schema: DATA_SET_SCHEMA,
            logs: rows.len(),
            copies: rows.iter().map(|row| row.copies).sum(),
            analysed: facts().count(),
            failed: rows.iter().filter(|row| row.record.is_failed()).count(),
            with_losses: lost.count(),
            with_findings: reports.count(),
            breaking_policy: broken.count(),
            duration_s: facts().map(|facts| facts.duration_s).sum(),
        }
    }
}
