//! A difference between two sensors counts as a contradiction once it has lasted.

use super::super::fault::{Amount, Component};
use super::super::notice::{Found, Limits, Notice};
use crate::machine::FaultKind;

/// A difference that must stay above its tolerance for some time.
#[derive(Debug, Clone)]
pub(super) struct LastingDifference {
    tolerance: f64,
    /// For so long (s).
    lasting_s: f64,
    since_ns: Option<i64>,
}

impl LastingDifference {
    pub(super) fn new(tolerance: f64, lasting_s: f64) -> Self {
        Self {
            tolerance,
            lasting_s,
            since_ns: None,
        }
    }

    pub(super) fn reset(&mut self) {
        self.since_ns = None;
    }

    /// Takes the difference of a sample, in the unit of the tolerance, and reports it to `found` if it has lasted.
    pub(super) fn check(
        &mut self,
        stamp_ns: i64,
        difference: f64,
        limits: &Limits,
        found: &mut Found<'_>,
    ) {
        self.check_beyond(stamp_ns, difference, self.tolerance, limits, found);
    }

    /// The same with a tolerance of this sample.
    pub(super) fn check_beyond(
        &mut self,
        stamp_ns: i64,
        difference: f64,
        tolerance: f64,
        limits: &Limits,
        found: &mut Found<'_>,
    ) {
        // Written so that NaN is no difference.
        if !(difference > tolerance) {
            self.reset();
            return;
        }
        let since_ns = *self.since_ns.get_or_insert(stamp_ns);
        if limits.elapsed_s(since_ns, stamp_ns) >= self.lasting_s {
            found(Notice {
                kind: FaultKind::Contradiction,
                component: Component::Value,
                since_ns,
                measure: difference,
                limit: tolerance,
                amount: Amount::default(),
            });
        }
    }
}
