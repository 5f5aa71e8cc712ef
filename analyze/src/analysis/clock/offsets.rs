//! Offsets between the clocks of topics, and which of them may be applied.

use schemars::JsonSchema;
use serde::Serialize;

use super::delay::Delay;
use crate::load::Signal;
use crate::load::linkage_force::LinkageForce;

/// Offsets with a larger standard deviation (s) are not applied.
const WORST_APPLIED_S: f64 = 0.015;
/// An offset is real if it is this many standard deviations, and worth a word or a correction if it is
/// larger than this (s).
const REAL_SIGMAS: f64 = 3.0;
const LEAST_OFFSET_S: f64 = 0.005;

/// Offsets between the topics of a log.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct ClockOffsets {
    /// The topic that the others are compared with; null where none can be.
    pub reference: Option<String>,
    /// Every topic of a signal.
    pub topics: Vec<TopicOffset>,
    /// What was compared.
    pub pairs: Vec<PairOffset>,
}

/// By how much the stamps of a topic are wrong against the reference.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct TopicOffset {
    /// The topic.
    pub topic: String,
    /// What has to be added to its stamps; null where the log does not tell. What the machine file states
    /// is already part of the stamps.
    pub offset_s: Option<f64>,
    /// Standard deviation of that.
    pub sigma_s: Option<f64>,
    /// Whether it was added, because that was asked for.
    pub applied: bool,
    /// What the machine file states for this topic; it was added.
    pub stated_s: Option<f64>,
    /// Why there is no offset.
    pub why_not: Option<String>,
}

/// How late one topic is against another.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct PairOffset {
    /// The topic whose stamps may be late.
    pub topic: String,
    /// The topic that it is compared with.
    pub against: String,
    /// What both feel.
    pub by: &'static str,
    /// By how much the stamps of the first are late; null where the signals do not tell.
    pub late_s: Option<f64>,
    /// Standard deviation of that.
    pub sigma_s: Option<f64>,
    /// Correlation of the two at the best delay.
    pub correlation: Option<f64>,
    /// Why the signals do not tell.
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
    /// Whether the offset is real and large enough to matter.
    #[must_use]
    pub fn matters(&self) -> bool {
        let (Some(offset), Some(sigma)) = (self.offset_s, self.sigma_s) else {
            return false;
        };
        offset.abs() > (REAL_SIGMAS * sigma).max(LEAST_OFFSET_S)
    }

    /// Whether it is known well enough to be applied.
    fn is_applicable(&self) -> bool {
        self.matters() && self.sigma_s.is_some_and(|sigma| sigma <= WORST_APPLIED_S)
    }
}

impl ClockOffsets {
    /// Adds the offsets that are real and well known to the stamps of their signals; tells whether there
    /// was any.
    pub(crate) fn apply(&mut self, signals: &mut [Signal], forces: &mut [LinkageForce]) -> bool {
        let mut any = false;
        for offset in self.topics.iter_mut().filter(|o| o.is_applicable()) {
            let seconds = offset.offset_s.unwrap_or(0.0);
            for signal in signals.iter_mut().filter(|s| s.topic == offset.topic) {
                signal.recording.shift(seconds);
            }
            for force in forces.iter_mut().filter(|f| f.topic == offset.topic) {
                force.shift(seconds);
            }
            offset.applied = true;
            any = true;
        }
        any
    }
}
