//! The timing of a topic: rate, gaps, offset and drift against the log time.

use schemars::JsonSchema;
use serde::Serialize;

use super::{
    stamp::StampDecision,
    steps::{BackwardStep, Gap},
};

/// Header stamp minus log time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct StampOffset {
    /// The smallest.
    pub min_s: f64,
    /// The median.
    pub median_s: f64,
    /// The largest.
    pub max_s: f64,
    /// Median absolute deviation from the median.
    pub mad_s: f64,
    /// Drift against the log time (ppm): Theil-Sen slope.
    pub drift_ppm: f64,
    /// Standard deviation of the drift.
    pub drift_sigma_ppm: f64,
    /// Standard deviation of single stamps about the fitted line, from their median absolute
    /// deviation.
    pub jitter_s: f64,
}

/// The timing of a topic. Periods and stamps are those of the chosen source.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TopicTiming {
    /// The time used, and why.
    pub clock: StampDecision,
    /// The number of messages.
    pub message_count: usize,
    /// The first stamp.
    pub first_stamp_ns: Option<i64>,
    /// The last stamp.
    pub last_stamp_ns: Option<i64>,
    /// Mean rate over the whole log (Hz); `None` for fewer than two stamps.
    pub rate_hz: Option<f64>,
    /// Median time between messages.
    pub median_period_s: Option<f64>,
    /// Median absolute deviation of the period.
    pub period_mad_s: Option<f64>,
    /// Longest time between messages.
    pub max_period_s: Option<f64>,
    /// Header stamp minus log time; `None` without stamps.
    pub header_minus_log: Option<StampOffset>,
    /// Pauses longer than 0.1 s and five median periods: the thousand longest, in order of time.
    pub gaps: Vec<Gap>,
    /// Whether there are more gaps.
    pub has_more_gaps: bool,
    /// Messages that repeat the previous stamp.
    pub duplicate_stamps: usize,
    /// Messages with an earlier stamp than the previous one.
    pub backward_stamps: usize,
    /// The largest backward step.
    pub largest_backward: Option<BackwardStep>,
    /// Messages with a missing or zero header stamp.
    pub zero_stamps: usize,
    /// Messages whose header stamp is not a date from 1990 to 2100.
    pub stamps_not_dates: usize,
}
