//! Totals of a run: `screen.json`, written last. If it exists, data set and page are complete.

use serde::Serialize;

use super::data_set::DATA_SET_SCHEMA;
use super::merge::LogRow;
use crate::base::built::built;
use crate::policy::Judgement;

built! {
    /// Counts over the logs of a data set.
    #[derive(Debug, Clone, PartialEq, Serialize)]
    pub struct Totals: pub(super) fn of(rows: &[LogRow], judgements: &[Option<Judgement>], min_valid: f64) {
        let facts = || rows.iter().filter_map(|row| Some(row.record.analysed()?.0));
        let undecided = rows.iter().zip(judgements).filter(|(row, judgement)| {
            let facts = row.record.analysed().map(|(facts, _)| facts);
            let is_open = |judgement: &Judgement| judgement.undecided.is_some();
            facts.is_some_and(|facts| {
                facts.undecided(min_valid).is_some() || judgement.as_ref().is_some_and(is_open)
            })
        });
        let broken = || {
            let judged = judgements.iter().flatten();
            judged.filter(|judgement| !judgement.passed)
        };
        let judged = rows.iter().zip(judgements);
        let unaccepted = judged.filter(|(row, judgement)| {
            let accepted = judgement.as_ref().is_some_and(|judgement| judgement.passed);
            row.record.is_failed() && !accepted
        });
    } {
        /// Version of the data set's columns and of this document.
        pub schema: u32 = DATA_SET_SCHEMA,
        /// Logs of different content, including unreadable ones.
        pub logs: usize = rows.len(),
        /// Paths with the same content as another.
        pub copies: u64 = rows.iter().map(|row| row.copies).sum(),
        /// Analysed logs.
        pub analysed: usize = facts().count(),
        /// Failed logs.
        pub failed: usize = rows.iter().filter(|row| row.record.is_failed()).count(),
        /// Logs with losses.
        pub with_losses: usize = facts().filter(|facts| facts.has_losses()).count(),
        /// Logs with an event of a wheel or an edge, or with a load within two standard deviations of zero, whether or not they have
        /// a report.
        pub with_findings: usize = facts().filter(|facts| facts.has_findings()).count(),
        /// Analysed logs that decide nothing: no row, or too little time, is computable.
        pub undecided: usize = undecided.count(),
        /// Logs that violate the policy, failed ones and those that decide nothing included.
        pub breaking_policy: usize = broken().count(),
        /// Logs that broke a rule by what was found in them.
        pub breaking_by_evidence: usize = broken().filter(|judgement| judgement.is_broken_by_evidence()).count(),
        /// Failed logs that no policy accepts.
        pub failed_unaccepted: usize = unaccepted.count(),
        /// Total duration of the analysed logs (s).
        pub duration_s: f64 = facts().map(|facts| facts.duration_s).sum(),
    }
}
