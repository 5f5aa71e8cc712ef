//! Statistics of the steps between consecutive times of a topic.

use std::{cmp::Reverse, collections::BinaryHeap};

use schemars::JsonSchema;
use serde::Serialize;

use super::{line::median, thinned::Thinned, time::seconds_between};

/// A shorter pause is not a gap, however fast the topic (ns).
const SHORTEST_GAP_NS: i64 = 100_000_000;
const GAP_PERIODS: f64 = 5.0;
/// Most gaps listed; the longest are kept.
const MOST_GAPS: usize = 1000;

/// A pause in a topic.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Gap {
    /// The last stamp before the gap.
    pub start_ns: i64,
    /// Its duration (s).
    pub duration_s: f64,
}

/// A step back of the stamps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct BackwardStep {
    /// The stamp before the step.
    pub from_ns: i64,
    /// The stamp after the step.
    pub to_ns: i64,
    /// The log time of the message after the step.
    pub log_time_ns: i64,
}

impl BackwardStep {
    /// The size of the step (s).
    pub fn size_s(&self) -> f64 {
        seconds_between(self.to_ns, self.from_ns)
    }
}

/// Collects the steps of one of a topic's times.
#[derive(Debug, Clone, Default)]
pub(super) struct Steps {
    count: usize,
    pub(super) first_ns: Option<i64>,
    pub(super) last_ns: Option<i64>,
    /// Whether any two of the times differ.
    pub(super) changes: bool,
    forward_s: f64,
    longest_ns: Option<i64>,
    some: Thinned<i64>,
    pub(super) duplicates: usize,
    pub(super) backward: usize,
    pub(super) largest_backward: Option<BackwardStep>,
    /// Length and start of the longest pauses, as a heap with the shortest on top.
    pauses: BinaryHeap<Reverse<(i64, i64)>>,
    /// The longest pause that was dropped.
    left_out_ns: i64,
}

impl Steps {
    /// Adds the times of messages, each with its log time (ns).
    #[inline]
    pub(super) fn extend(&mut self, times: impl Iterator<Item = (i64, i64)>) {
        let mut times = times;
        let mut before = match self.last_ns {
            Some(last_ns) => last_ns,
            None => {
                let Some((first_ns, _)) = times.next() else {
                    return;
                };
                self.count += 1;
                self.first_ns = Some(first_ns);
                first_ns
            }
        };
        // in registers, over many messages
        let (mut count, mut forward_s) = (self.count, self.forward_s);
        let mut longest_ns = self.longest_ns.unwrap_or(0);
        for (time_ns, log_time_ns) in times {
            count += 1;
            let step_ns = time_ns.saturating_sub(before);
            if step_ns > 0 {
                forward_s += seconds_between(before, time_ns);
                longest_ns = longest_ns.max(step_ns);
                self.some.push(step_ns);
                if step_ns > SHORTEST_GAP_NS {
                    self.note_pause(step_ns, before);
                }
            } else {
                self.not_forward(before, time_ns, log_time_ns);
            }
            before = time_ns;
        }
        self.last_ns = Some(before);
        self.count = count;
        self.forward_s = forward_s;
        // every step forward is longer
        self.longest_ns = Some(longest_ns).filter(|&longest| longest > 0);
        self.changes |= self.longest_ns.is_some() || self.backward > 0;
    }

    #[cold]
    fn not_forward(&mut self, before: i64, time_ns: i64, log_time_ns: i64) {
        if time_ns == before {
            self.duplicates += 1;
            return;
        }
        self.backward += 1;
        let step = BackwardStep {
            from_ns: before,
            to_ns: time_ns,
            log_time_ns,
        };
        let is_larger = |largest: &BackwardStep| largest.size_s() < step.size_s();
        if self.largest_backward.as_ref().is_none_or(is_larger) {
            self.largest_backward = Some(step);
        }
    }

    #[cold]
    fn note_pause(&mut self, step_ns: i64, start_ns: i64) {
        self.pauses.push(Reverse((step_ns, start_ns)));
        if self.pauses.len() > MOST_GAPS
            && let Some(Reverse((shortest, _))) = self.pauses.pop()
        {
            self.left_out_ns = self.left_out_ns.max(shortest);
        }
    }

    /// Whether any step forward is longer than `most_ns`.
    pub(super) fn leaps(&self, most_ns: i64) -> bool {
        self.longest_ns.is_some_and(|longest| longest > most_ns)
    }

    /// Messages per second. Backward steps do not shorten the time.
    pub(super) fn rate_hz(&self) -> Option<f64> {
        (self.forward_s > 0.0).then(|| (self.count - 1) as f64 / self.forward_s)
    }

    pub(super) fn longest_s(&self) -> Option<f64> {
        self.longest_ns.map(|ns| seconds_between(0, ns))
    }

    /// Median of the steps forward, and the median absolute deviation from it (s).
    pub(super) fn period_s(&self) -> Option<(f64, f64)> {
        let steps = self.some.values().iter();
        let mut steps: Vec<f64> = steps.map(|&ns| seconds_between(0, ns)).collect();
        let period = median(&mut steps)?;
        let mut deviations: Vec<f64> = steps.iter().map(|step| (step - period).abs()).collect();
        Some((period, median(&mut deviations)?))
    }

    /// The gaps in order of time, and whether there are more.
    pub(super) fn gaps(&self) -> (Vec<Gap>, bool) {
        let period_s = self.period_s().map_or(0.0, |(period, _)| period);
        let longest_s = (period_s * GAP_PERIODS).max(seconds_between(0, SHORTEST_GAP_NS));
        let gap = |&Reverse((step_ns, start_ns)): &Reverse<(i64, i64)>| Gap {
            start_ns,
            duration_s: seconds_between(0, step_ns),
        };
        let mut gaps: Vec<Gap> = self.pauses.iter().map(gap).collect();
        gaps.retain(|gap| gap.duration_s > longest_s);
        gaps.sort_by_key(|gap| gap.start_ns);
        (gaps, seconds_between(0, self.left_out_ns) > longest_s)
    }
}
