//! Common parts of the checks: their limits, and the notice of a fault.

use super::explanation::Explanation;
use super::false_alarms;
use super::fault::{Amount, Component, Finding, Part};
use crate::machine::{FaultKind, Machine, Policy};
use crate::state::{Sample, Sensor};

/// Limits and policies of the checks by the machine file.
#[derive(Debug, Clone)]
pub(super) struct Rules {
    pub(super) limits: Limits,
    pub(super) policies: Policies,
}

/// The treatment of each kind of fault.
pub(super) type Policies = [Policy; FaultKind::ALL.len()];

impl Rules {
    pub(super) fn of(machine: &Machine) -> Self {
        let spec = machine.plausibility();
        Self {
            limits: Limits {
                max_gap_s: machine.estimator().max_gap,
                frozen_samples: spec.frozen_samples,
                sticks: false_alarms::threshold_of_repeats(spec.false_alarms_per_hour),
                quaternion_tolerance: spec.quaternion_tolerance,
                rate_tolerance_share: spec.rate_tolerance_share,
            },
            policies: FaultKind::ALL.map(|kind| spec.policy_of(kind)),
        }
    }
}

/// Settings shared by all checks.
#[derive(Debug, Clone)]
pub(super) struct Limits {
    pub(super) max_gap_s: f64,
    pub(super) frozen_samples: u32,
    /// Log likelihood ratio from which a signal that repeats itself is not measured any more.
    pub(super) sticks: f64,
    pub(super) quaternion_tolerance: f64,
    pub(super) rate_tolerance_share: f64,
}

/// Shortest duration of a run of repeats that counts with fewer samples than usual (s), and the fewest samples of it.
const LONG_S: f64 = 1.0;
const FEWEST_REPEATS: u32 = 10;

impl Limits {
    #[cfg(test)]
    pub(super) const OF_TESTS: Self = Self {
        max_gap_s: 0.25,
        frozen_samples: 100,
        sticks: 25.0,
        quaternion_tolerance: 0.01,
        rate_tolerance_share: 0.2,
    };

    pub(super) fn elapsed_s(&self, from_ns: i64, to_ns: i64) -> f64 {
        to_ns.saturating_sub(from_ns) as f64 * 1e-9
    }

    /// Whether so many repeats, which lasted so long, are enough to count.
    pub(super) fn is_long(&self, repeats: u32, lasted_s: f64) -> bool {
        repeats >= self.frozen_samples || (repeats >= FEWEST_REPEATS && lasted_s >= LONG_S)
    }
}

/// A fault as reported by a check, before it is assigned to a part.
pub(super) struct Notice {
    pub(super) kind: FaultKind,
    pub(super) component: Component,
    pub(super) since_ns: i64,
    pub(super) possible_since_ns: i64,
    pub(super) measure: f64,
    pub(super) limit: f64,
    pub(super) amount: Amount,
    pub(super) explanation: Option<Explanation>,
}

impl Notice {
    /// A fault of the values since this time (ns), of which nothing more is known.
    pub(super) fn of(kind: FaultKind, since_ns: i64) -> Self {
        Self {
            kind,
            component: Component::Value,
            since_ns,
            possible_since_ns: since_ns,
            measure: f64::NAN,
            limit: f64::NAN,
            amount: Amount::default(),
            explanation: None,
        }
    }

    /// Returns the notice about another component.
    pub(super) fn about(mut self, component: Component) -> Self {
        self.component = component;
        self
    }

    /// Returns the notice with the magnitude of the fault and the limit of it, NaN if there is none, in the unit of its kind.
    pub(super) fn measured(mut self, measure: f64, limit: f64) -> Self {
        (self.measure, self.limit) = (measure, limit);
        self
    }

    /// Returns the notice with the possible error of the value (in its unit) and of its derivative (per second).
    pub(super) fn amount(mut self, value: f64, rate: f64) -> Self {
        self.amount = Amount { value, rate };
        self
    }

    /// Returns the notice with the best explanation of the fault.
    pub(super) fn explained(mut self, explanation: Explanation) -> Self {
        self.explanation = Some(explanation);
        self
    }

    /// Returns the notice of a fault that may have begun at an earlier stamp (ns).
    pub(super) fn possible_since(mut self, stamp_ns: i64) -> Self {
        self.possible_since_ns = stamp_ns;
        self
    }

    /// Creates the notice that sensors contradict each other, by the logarithm of a likelihood ratio.
    pub(super) fn contradiction(
        since_ns: i64,
        evidence: f64,
        threshold: f64,
        explanation: Explanation,
    ) -> Self {
        Notice::of(FaultKind::Contradiction, since_ns)
            .measured(evidence, threshold)
            .explained(explanation)
    }

    /// Creates the notice that a position jumped `by` so much and stayed, of which `moved` may be motion: one side of the jump is
    /// wrong.
    pub(super) fn offset(since_ns: i64, by: f64, moved: f64) -> Self {
        Notice::of(FaultKind::Contradiction, since_ns)
            .measured(by, f64::NAN)
            .amount(moved, 0.0)
    }

    pub(super) fn not_finite(stamp_ns: i64, component: Component) -> Self {
        Notice::of(FaultKind::NotFinite, stamp_ns)
            .about(component)
            .measured(1.0, f64::NAN)
    }
}

pub(super) type Found<'f> = dyn FnMut(Notice) + 'f;

/// Collects findings, up to the capacity reserved.
pub(super) struct Note<'n> {
    findings: &'n mut Vec<Finding>,
    policies: &'n Policies,
    sensor: Sensor,
    stamp_ns: i64,
}

impl<'n> Note<'n> {
    pub(super) fn new(
        findings: &'n mut Vec<Finding>,
        policies: &'n Policies,
        sample: &Sample<'_>,
    ) -> Self {
        Self {
            findings,
            policies,
            sensor: sample.sensor,
            stamp_ns: sample.stamp_ns,
        }
    }

    pub(super) fn of(&mut self, part: Part) -> impl FnMut(Notice) + '_ {
        move |notice| {
            if self.findings.len() == self.findings.capacity() {
                return;
            }
            self.findings.push(Finding {
                sensor: self.sensor,
                part,
                kind: notice.kind,
                component: notice.component,
                policy: self.policies[notice.kind as usize],
                since_ns: notice.since_ns,
                possible_since_ns: notice.possible_since_ns,
                stamp_ns: self.stamp_ns,
                measure: notice.measure,
                limit: notice.limit,
                amount: notice.amount,
                explanation: notice.explanation,
            });
        }
    }
}
