//! Which of a message's three times is its time, how the clocks of a log behave, and how all topics of a
//! log come to one time base.
//!
//! A message has up to three times: the stamp in its header, when it was sent, when it was recorded. A
//! [`StampDecision`] takes the first of them that can be used. [`TopicStatistics`] tells how the stamps of a
//! topic behave. The [`TimeBase`] of a log is one clock, that of most topics; topics with another one are put
//! on it by way of the log time, which all messages have. What was odd and what was done about it is told by
//! [`ClockFinding`]s.

mod anchor;
mod finding;
mod line;
mod odd;
mod own_clock;
mod placing;
mod restarts;
mod stamp;
mod statistics;
mod steps;
mod thinned;
mod time_base;
mod times;
mod timing;

pub use self::{
    finding::{ClockFinding, ClockFindingKind, Treatment},
    placing::{Placed, StampCorrection},
    stamp::{StampDecision, StampSource},
    statistics::TopicStatistics,
    steps::{BackwardStep, Gap},
    time_base::TimeBase,
    times::Times,
    timing::{StampOffset, TopicTiming},
};

pub(crate) const NS_PER_S: f64 = 1e9;
/// Start of 1990: stamps before it are counted from the start of something.
pub(crate) const EARLIEST_DATE_NS: i64 = 631_152_000_000_000_000;
/// Start of 2100: no machine has logged after it.
pub(crate) const LATEST_DATE_NS: i64 = 4_102_444_800_000_000_000;

/// Whether a time is a date that a log can have.
pub(crate) fn is_date(stamp_ns: i64) -> bool {
    (EARLIEST_DATE_NS..LATEST_DATE_NS).contains(&stamp_ns)
}

/// Subtracted as integers first: a date in nanoseconds is too large for an exact f64.
pub(crate) fn seconds_between(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 / NS_PER_S
}
