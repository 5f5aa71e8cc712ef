//! Offsets between the clocks of topics, and the conditions for applying them.

use schemars::JsonSchema;
use serde::Serialize;

use super::delay::Delay;
use crate::load::Signal;
use crate::load::linkage_force::LinkageForce;

/// Largest standard deviation of an applied offset (s).
const WORST_APPLIED_S: f64 = 0.015;
/// An offset is significant beyond this many standard deviations, and relevant beyond [`LEAST_OFFSET_S`] (s).
const REAL_SIGMAS: f64 = 3.0;
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
    /// Why the delay is unknown.
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

    /// Whether it is precise enough to be applied.
    fn is_applicable(&self) -> bool {
        self.matters() && self.sigma_s.is_some_and(|sigma| sigma <= WORST_APPLIED_S)
    }
}

impl ClockOffsets {
    /// Applies the significant and precise offsets to the stamps of their signals.
    pub(crate) fn apply(&mut self, signals: &mut [Signal], forces: &mut [LinkageForce]) {
        self.shift(signals, forces, 1.0);
        for offset in self.topics.iter_mut().filter(|o| o.is_applicable()) {
            offset.applied = true;
        }
    }

    /// Whether there is an offset to apply.
    pub(crate) fn are_applicable(&self) -> bool {
        self.topics.iter().any(TopicOffset::is_applicable)
    }

    /// Shifts the stamps of the signals by this multiple of the offsets that can be applied.
    pub(crate) fn shift(&self, signals: &mut [Signal], forces: &mut [LinkageForce], times: f64) {
        for offset in self.topics.iter().filter(|o| o.is_applicable()) {
            let seconds = times * offset.offset_s.unwrap_or(0.0);
            for signal in signals.iter_mut().filter(|s| s.topic == offset.topic) {
                signal.recording.shift(seconds);
            }
            for force in forces.iter_mut().filter(|f| f.topic == offset.topic) {
                force.shift(seconds);
            }
        }
    }
}
