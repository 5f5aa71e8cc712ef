//! Chooses the time stamp of each topic, analyses its clock, and puts all topics on one time base.
//!
//! A message has up to three times: the stamp in its header, the publish time and the log time. A
//! [`StampDecision`] selects the first usable one. [`TopicStatistics`] describes rate, gaps and
//! offsets of the stamps. The [`TimeBase`] of a log is the clock of most topics; topics on other
//! clocks are mapped to it through the log time, which all messages have. [`ClockFinding`]s report
//! anomalies and their treatment.

mod anchor;
mod describe;
mod finding;
mod line;
mod log_jumps;
mod ordered_bits;
mod own_clock;
mod pairs;
mod placement;
mod placing;
mod restarts;
mod stamp;
mod stamp_steps;
mod statistics;
mod steps;
mod strays;
mod thinned;
mod time;
mod time_base;
mod times;
mod timing;

pub(crate) use self::{anchor::ClockFit, times::TimesSlice};
pub use self::{
    finding::{ClockFinding, ClockFindingKind, Treatment},
    placement::Placement,
    placing::{Placed, StampCorrection},
    stamp::{StampDecision, StampSource},
    statistics::TopicStatistics,
    steps::{BackwardStep, Gap},
    time_base::TimeBase,
    times::{MessageTimes, Times},
    timing::{StampOffset, TopicTiming},
};
