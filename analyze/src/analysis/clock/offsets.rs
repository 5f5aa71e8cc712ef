//! Offsets between the clocks of topics, and the conditions for applying them.

use schemars::JsonSchema;
use serde::Serialize;

use super::delay::Delay;
use crate::load::Signal;
use crate::load::linkage_force::LinkageForce;

/// Largest standard deviation of an applied offset (s).
const WORST_APPLIED_S: f64 = 0.015;
/// An offset or a contradiction is significant beyond this many standard deviations, an offset relevant beyond
/// [`LEAST_OFFSET_S`] (s).
pub(super) const REAL_SIGMAS: f64 = 3.0;
const LEAST_OFFSET_S: f64 = 0.005;

/// Offsets between the topics of a log.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct ClockOffsets {
    /// The reference topic; null if there is none.
    pub reference: Option<String>,
    /// Offsets of all topics with signals.
    pub topics: Vec<TopicOffset>,
    /// Compared pairs.
    pub pairs: Vec<PairOffset>,
}

/// Offset of a topic's clock relative to the reference.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct TopicOffset {
    /// The topic.
    pub topic: String,
    /// Correction to add to its stamps, beyond the one in the machine file; null if the log does not
    /// determine it.
    pub offset_s: Option<f64>,
    /// Its standard deviation.
    pub sigma_s: Option<f64>,
    /// Whether it was applied (on request).
    pub applied: bool,
    /// Correction stated in the machine file; always applied.
    pub stated_s: Option<f64>,
    /// Why there is no offset.
    pub why_not: Option<String>,
}

/// Delay of one topic relative to another.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct PairOffset {
    /// The topic whose stamps may be late.
    pub topic: String,
    /// The topic it is compared with.
    pub against: String,
    /// The motion that both measure.
    pub by: &'static str,
    /// Delay of the first topic's stamps; null if the signals do not determine it.
    pub late_s: Option<f64>,
    /// Its standard deviation.
    pub sigma_s: Option<f64>,
    /// Correlation at that delay.
    pub correlation: Option<f64>,
    /// Why the delay is unknown or, where there is one, not used.
    pub why_not: Option<String>,
}

impl PairOffset {
    pub(super) fn new(
        topic: &str,
        against: &str,
        by: &'static str,
        found: Result<Delay, String>,
    ) -> Self {
        let delay = found.as_ref().ok();
        Self {
            topic: topic.into(),
            against: against.into(),
            by,
            late_s: delay.map(|delay| delay.seconds),
            sigma_s: delay.map(|delay| delay.sigma),
            correlation: delay.map(|delay| delay.correlation),
            why_not: found.err(),
        }
    }
}

impl TopicOffset {
    /// Whether the offset is significant and large enough to matter.
    #[must_use]
    pub fn matters(&self) -> bool {
        let (Some(offset), Some(sigma)) = (self.offset_s, self.sigma_s) else {
            return false;
        };
        offset.abs() > (REAL_SIGMAS * sigma).max(LEAST_OFFSET_S)
    }

    /// Whether the offset is precise enough to be applied.
    fn is_applicable(&self) -> bool {
        self.matters() && self.sigma_s.is_some_and(|sigma| sigma <= WORST_APPLIED_S)
    }
}

impl ClockOffsets {
    /// Whether there is an offset to apply.
    pub(crate) fn are_applicable(&self) -> bool {
        self.applicable().next().is_some()
    }

    /// Returns the signals with their stamps corrected by the significant and precise offsets.
    pub(crate) fn corrected(&self, signals: &[Signal]) -> Vec<Signal> {
        let mut signals = signals.to_vec();
        for (topic, seconds) in self.applicable() {
            for signal in signals.iter_mut().filter(|s| s.topic == topic) {
                signal.recording.shift(seconds);
            }
        }
        signals
    }

    /// Corrects the stamps of forces by the same offsets.
    pub(crate) fn correct(&self, forces: &mut [LinkageForce]) {
        for (topic, seconds) in self.applicable() {
            for force in forces.iter_mut().filter(|f| f.topic == topic) {
                force.shift(seconds);
            }
        }
    }

    /// Notes which offsets were applied.
    pub(crate) fn set_applied(&mut self) {
        for offset in &mut self.topics {
            offset.applied = offset.is_applicable();
        }
    }

    /// The topics with an offset to apply (s).
    fn applicable(&self) -> impl Iterator<Item = (&str, f64)> {
        let topics = self.topics.iter().filter(|offset| offset.is_applicable());
        topics.filter_map(|offset| Some((offset.topic.as_str(), offset.offset_s?)))
    }
}
