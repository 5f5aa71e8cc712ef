//! The clock of one topic, before it is compared with others.

use super::{
    restarts::{self, MOST_RESTARTS, Restart},
    stamp::{StampDecision, StampSource},
    statistics::TopicStatistics,
    times::{Stamps, Times},
};
use crate::file::Format;

/// The time source of a topic, and where its clock restarts.
pub(super) struct OwnClock<'t> {
    pub(super) decision: StampDecision,
    /// The stamps as recorded.
    pub(super) stamps: Stamps<'t>,
    pub(super) restarts: Vec<Restart>,
}

impl<'t> OwnClock<'t> {
    pub(super) fn of(
        times: &'t Times,
        statistics: &TopicStatistics,
        without_publish: Option<Format>,
    ) -> Self {
        let decision = statistics.decide_in(without_publish);
        let clock = Self::by(decision, times, statistics);
        if clock.restarts.len() <= MOST_RESTARTS {
            return clock;
        }
        let source = match statistics.has_publish_times() {
            true if clock.decision.source == StampSource::Header => StampSource::Publish,
            _ => StampSource::Log,
        };
        let reason = format!(
            "{} restarts {} times",
            clock.decision.source,
            clock.restarts.len()
        );
        let mut other = Self::by(StampDecision { source, reason }, times, statistics);
        if other.restarts.len() > MOST_RESTARTS {
            other.restarts.clear();
        }
        other
    }

    fn by(decision: StampDecision, times: &'t Times, statistics: &TopicStatistics) -> Self {
        let stamps = times.by(decision.source);
        let restarts = match decision.source {
            // a restart of the recorder's clock cannot be detected
            StampSource::Log => Vec::new(),
            // as a rule; spares a look at every stamp
            source if statistics.advances(source, restarts::LEAST_LEAP_NS) => Vec::new(),
            StampSource::Header | StampSource::Publish => restarts::find(stamps, times.log_ns()),
        };
        Self {
            decision,
            stamps,
            restarts,
        }
    }
}
