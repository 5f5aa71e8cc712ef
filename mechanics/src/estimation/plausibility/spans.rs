//! Findings of a whole log merged into time spans.

use super::fault::Finding;
use super::treatment::{Judgement, RowEffect};
use crate::machine::FaultKind;
use crate::machine::Machine;
use crate::state::Sensor;

/// A time span in which every sample of a part had the same fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaultSpan {
    /// The worst of the findings, with the largest amounts of any.
    pub worst: Finding,
    /// Start of the fault (ns).
    pub start_ns: i64,
    /// Stamp of the last sample with the fault (ns).
    pub end_ns: i64,
    /// Stamp of the first sample without the fault (ns); `None` if there is none.
    pub until_ns: Option<i64>,
    /// Number of faulty samples, as far as they were judged individually.
    pub samples: u64,
}

impl FaultSpan {
    /// The worst value, in the unit of [`Part::measure_unit`](super::Part::measure_unit).
    #[must_use]
    pub fn measure(&self) -> f64 {
        match self.worst.kind {
            FaultKind::NotFinite => self.samples as f64,
            _ => self.worst.measure,
        }
    }
}

/// Collects findings sample by sample. Unlike the checks, it allocates.
#[derive(Debug, Clone, Default)]
pub struct FaultSpans {
    open: Vec<FaultSpan>,
    closed: Vec<FaultSpan>,
}

impl FaultSpans {
    /// Takes the findings of one sample; an empty list if it is faultless.
    pub fn take(&mut self, sensor: Sensor, stamp_ns: i64, findings: &[Finding]) {
        if findings.is_empty() && self.open.is_empty() {
            return;
        }
        for finding in findings {
            let known = self
                .open
                .iter_mut()
                .find(|span| is_same_fault(&span.worst, finding));
            match known {
                Some(span) => {
                    span.start_ns = span.start_ns.min(finding.since_ns);
                    span.extend(finding);
                }
                None => self.open.push(FaultSpan {
                    worst: *finding,
                    start_ns: finding.since_ns,
                    end_ns: stamp_ns,
                    until_ns: None,
                    samples: 1,
                }),
            }
        }
        let closed = &mut self.closed;
        self.open.retain_mut(|span| {
            let goes_on = span.worst.sensor != sensor || span.end_ns >= stamp_ns;
            if !goes_on {
                span.until_ns = Some(stamp_ns);
                closed.push(*span);
            }
            goes_on
        });
    }

    /// All spans, sorted by start.
    #[must_use]
    pub fn finish(self) -> Vec<FaultSpan> {
        let mut spans = self.closed;
        spans.extend(self.open);
        spans.sort_by_key(|span| (span.start_ns, span.worst.part, span.worst.kind));
        spans
    }
}

impl FaultSpan {
    /// Merges a later span of the same fault.
    pub fn merge(&mut self, later: &Self) {
        self.extend(&later.worst);
        self.end_ns = self.end_ns.max(later.end_ns);
        self.until_ns = match (self.until_ns, later.until_ns) {
            (Some(own), Some(other)) => Some(own.max(other)),
            _ => None,
        };
        self.samples += later.samples - 1;
    }

    fn extend(&mut self, finding: &Finding) {
        let amount = self.worst.amount;
        let possible_since_ns = self.worst.possible_since_ns.min(finding.possible_since_ns);
        if badness(finding) > badness(&self.worst) {
            self.worst = *finding;
        }
        self.worst.possible_since_ns = possible_since_ns;
        let largest = &mut self.worst.amount;
        largest.value = largest.value.max(amount.value);
        largest.rate = largest.rate.max(amount.rate);
        self.end_ns = finding.stamp_ns;
        self.samples += 1;
    }
}

fn is_same_fault(a: &Finding, b: &Finding) -> bool {
    (a.sensor, a.part, a.kind, a.component) == (b.sensor, b.part, b.kind, b.component)
}

fn badness(finding: &Finding) -> f64 {
    match finding.kind {
        FaultKind::JointLimit | FaultKind::NotUnit => finding.amount.value,
        _ => finding.measure.abs(),
    }
}

/// Iterates over the spans that are active at increasing times.
pub(crate) struct SpanWalk<'s> {
    spans: Vec<&'s FaultSpan>,
    next: usize,
    active: Vec<&'s FaultSpan>,
}

impl<'s> SpanWalk<'s> {
    /// `spans` must be sorted by start.
    pub(crate) fn new(spans: impl Iterator<Item = &'s FaultSpan>) -> Self {
        Self {
            spans: spans.collect(),
            next: 0,
            active: Vec::new(),
        }
    }

    /// Returns the judgement on a sample at this time. Inlined: nearly always it is the default, and copying that costs more.
    #[inline(always)]
    pub(crate) fn judgement(&mut self, stamp_ns: i64) -> Judgement {
        let mut judgement = Judgement::default();
        self.advance(stamp_ns, |span| stamp_ns > span.end_ns);
        for span in &self.active {
            judgement.add(&span.worst);
        }
        judgement
    }

    /// Whether the last judged sample lacks a value that the estimate requires.
    pub(crate) fn lacks_a_value(&self) -> bool {
        self.active.iter().any(|span| span.worst.lacks_a_value())
    }

    /// Effect of the faults on a row at this time, until the next sample without them.
    pub(crate) fn row_effect(
        &mut self,
        time_ns: i64,
        machine: &Machine,
        has_imu: bool,
    ) -> RowEffect {
        let mut effect = RowEffect::default();
        self.advance(time_ns, |span| {
            span.until_ns.is_some_and(|until| time_ns >= until)
        });
        for span in &self.active {
            effect.add(&span.worst, machine, has_imu);
        }
        effect
    }

    fn advance(&mut self, time_ns: i64, is_over: impl Fn(&FaultSpan) -> bool) {
        while let Some(span) = self.spans.get(self.next)
            && span.start_ns <= time_ns
        {
            self.active.push(span);
            self.next += 1;
        }
        self.active.retain(|span| !is_over(span));
    }
}

#[cfg(test)]
mod tests {
    use super::super::fault::{Amount, Component, Part};
    use super::*;
    use crate::machine::Policy;

    #[test]
    fn a_span_is_possible_since_the_earliest_of_its_findings() {
        let finding = |stamp_ns: i64, possible_since_ns: i64, measure: f64| Finding {
            sensor: Sensor::Joints(0),
            part: Part::Joint(0),
            kind: FaultKind::Contradiction,
            component: Component::Value,
            policy: Policy::Widen,
            since_ns: stamp_ns,
            possible_since_ns,
            stamp_ns,
            measure,
            limit: 1.0,
            amount: Amount {
                value: 0.0,
                rate: 0.0,
            },
            explanation: None,
        };
        let mut spans = FaultSpans::default();
        spans.take(Sensor::Joints(0), 10, &[finding(10, 3, 2.0)]);
        spans.take(Sensor::Joints(0), 20, &[finding(20, 9, 5.0)]);
        let mut found = spans.finish();
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].worst.possible_since_ns, 3);
        let later = FaultSpan {
            worst: finding(30, 1, 1.0),
            ..found[0]
        };
        found[0].merge(&later);
        assert_eq!(found[0].worst.possible_since_ns, 1);
    }
}
