//! Which of a message's three times is its time, how the clocks of a log behave, and how all topics of a
//! log come to one time base.
//!
//! A message has up to three times: the stamp in its header, when it was sent, when it was recorded. A
//! [`StampDecision`] takes the first of them that can be used. [`TopicStatistics`] tells how the stamps of a
//! topic behave. The [`TimeBase`] of a log is one clock, that of most topics; topics with another one are put
//! on it by way of the log time, which all messages have. What was odd and what was done about it is told by
//! [`ClockFinding`]s.

mod anchor;
mod describe;
mod finding;
mod line;
mod own_clock;
mod placing;
mod restarts;
mod stamp;
mod statistics;
mod steps;
mod thinned;
mod time;
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
