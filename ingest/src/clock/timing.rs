//! How the stamps of a topic behave: rate, gaps, offset and drift against the log time.

use schemars::JsonSchema;
use serde::Serialize;

use super::{
    stamp::StampDecision,
    steps::{BackwardStep, Gap},
};

/// By how much the header's stamps are ahead of the log time.
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
    /// By how much it grows, in millionths of the log time: slope of Theil and Sen.
    pub drift_ppm: f64,
    /// Standard deviation of the drift.
    pub drift_sigma_ppm: f64,
    /// Standard deviation of single stamps about that straight line, from their median absolute deviation.
    pub jitter_s: f64,
}

/// How the stamps of a topic behave. Periods and stamps are those of the chosen source.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TopicTiming {
    /// Which time is used, and why.
    pub clock: StampDecision,
    /// How many messages.
    pub message_count: usize,
    /// The first stamp.
    pub first_stamp_ns: Option<i64>,
    /// The last stamp.
    pub last_stamp_ns: Option<i64>,
    /// Messages a second, over the whole time; `None` for fewer than two stamps.
    pub rate_hz: Option<f64>,
    /// The median time from one message to the next.
    pub median_period_s: Option<f64>,
    /// Median absolute deviation from that.
    pub period_mad_s: Option<f64>,
    /// The longest time from one message to the next.
    pub max_period_s: Option<f64>,
    /// By how much the header's stamps are ahead of the log time; `None` without stamps.
    pub header_minus_log: Option<StampOffset>,
    /// Pauses longer than 0.1 s and than five median periods: the thousand longest, by time.
    pub gaps: Vec<Gap>,
    /// Whether there are more than those.
    pub has_more_gaps: bool,
    /// Messages with the stamp of the one before.
    pub duplicate_stamps: usize,
    /// Messages with an earlier stamp than the one before.
    pub backward_stamps: usize,
    /// The largest step back.
    pub largest_backward: Option<BackwardStep>,
    /// Messages whose header has no stamp, or zero.
    pub zero_stamps: usize,
    /// Messages whose header has a stamp that is no date from 1990 to 2100.
    pub stamps_not_dates: usize,
}
