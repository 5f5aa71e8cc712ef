//! Statistics of a topic's times, in bounded memory.

use super::{
    line::{Line, SIGMA_BY_MAD, median},
    stamp::{StampDecision, StampEvidence, StampSource},
    steps::Steps,
    thinned::Thinned,
    time::{is_date, seconds_between},
    timing::{StampOffset, TopicTiming},
};
use crate::file::Format;

/// Statistics of the times of a topic's messages, in bounded memory.
///
/// Counts, extremes and the longest gaps cover all messages; medians and drifts use some thousands
/// of evenly spaced ones.
#[derive(Debug, Clone, Default)]
pub struct TopicStatistics {
    messages: usize,
    stamped: usize,
    /// Header stamps outside the dates from 1990 to 2100.
    not_dates: usize,
    /// Whether any publish time differs from the log time.
    publish_is_apart: bool,
    publish_is_set: bool,
    header: Steps,
    /// Steps of the publish times, from the first that differs from the log time.
    publish: Steps,
    log: Steps,
    /// Log time and header stamp of some messages.
    pairs: Thinned<(i64, i64)>,
    /// Minimum and maximum of header stamp minus log time (ns).
    header_minus_log_ns: Option<(i64, i64)>,
}

impl TopicStatistics {
    /// Adds one message. A header stamp of zero counts as missing.
    pub fn push(&mut self, header_stamp_ns: Option<i64>, publish_time_ns: i64, log_time_ns: i64) {
        self.messages += 1;
        if publish_time_ns != log_time_ns && !self.publish_is_apart {
            self.publish_is_apart = true;
            self.publish = self.log.clone();
        }
        if self.publish_is_apart {
            self.publish.push(publish_time_ns, log_time_ns);
        }
        self.log.push(log_time_ns, log_time_ns);
        self.publish_is_set |= publish_time_ns != 0;
        let Some(stamp) = header_stamp_ns.filter(|&stamp| stamp != 0) else {
            return;
        };
        self.stamped += 1;
        self.not_dates += usize::from(!is_date(stamp));
        self.header.push(stamp, log_time_ns);
        self.pairs.push((log_time_ns, stamp));
        let offset = stamp.saturating_sub(log_time_ns);
        let (least, largest) = self.header_minus_log_ns.unwrap_or((offset, offset));
        self.header_minus_log_ns = Some((least.min(offset), largest.max(offset)));
    }

    /// The number of messages added.
    pub fn message_count(&self) -> usize {
        self.messages
    }

    /// The time to use.
    pub fn decide(&self) -> StampDecision {
        self.decide_in(None)
    }

    /// Like [`decide`](Self::decide), for a format without publish times.
    pub(super) fn decide_in(&self, without_publish: Option<Format>) -> StampDecision {
        StampEvidence {
            messages: self.messages,
            stamped: self.stamped,
            header_changes: self.header.changes,
            publish_is_apart: self.has_publish_times(),
            publish_changes: self.steps(StampSource::Publish).changes,
            without_publish,
        }
        .decide()
    }

    /// Whether any publish time differs from the log time.
    pub(super) fn has_publish_times(&self) -> bool {
        self.publish_is_apart && self.publish_is_set
    }

    /// Messages with a missing or zero header stamp.
    pub(super) fn zero_stamps(&self) -> usize {
        self.messages - self.stamped
    }

    pub(super) fn steps(&self, source: StampSource) -> &Steps {
        match source {
            StampSource::Header => &self.header,
            StampSource::Publish if self.publish_is_apart => &self.publish,
            StampSource::Publish | StampSource::Log => &self.log,
        }
    }

    /// The timing of the topic.
    pub fn timing(&self) -> TopicTiming {
        let clock = self.decide();
        let steps = self.steps(clock.source);
        let (gaps, has_more_gaps) = steps.gaps();
        let period = steps.period_s();
        TopicTiming {
            message_count: self.messages,
            first_stamp_ns: steps.first_ns,
            last_stamp_ns: steps.last_ns,
            rate_hz: steps.rate_hz(),
            median_period_s: period.map(|(median, _)| median),
            period_mad_s: period.map(|(_, mad)| mad),
            max_period_s: steps.longest_s(),
            header_minus_log: self.header_minus_log(),
            gaps,
            has_more_gaps,
            duplicate_stamps: steps.duplicates,
            backward_stamps: steps.backward,
            largest_backward: steps.largest_backward,
            zero_stamps: self.zero_stamps(),
            stamps_not_dates: self.not_dates,
            clock,
        }
    }

    /// Least and largest header stamp minus log time (ns); `None` without header stamps.
    pub(super) fn header_minus_log_ns(&self) -> Option<(i64, i64)> {
        self.header_minus_log_ns
    }

    /// Whether neither the times of this source nor the log times ever step back, and the times
    /// never leap ahead by more than this (ns).
    pub(super) fn advances(&self, source: StampSource, most_ns: i64) -> bool {
        let steps = self.steps(source);
        steps.backward == 0 && self.log.backward == 0 && !steps.leaps(most_ns)
    }

    fn header_minus_log(&self) -> Option<StampOffset> {
        let (least, largest) = self.header_minus_log_ns?;
        let pairs = self.pairs.values();
        let offsets = (pairs.iter()).map(|&(log, stamp)| (log, stamp.saturating_sub(log)));
        let line = Line::through(offsets)?;
        let mut offsets_s: Vec<f64> = (pairs.iter())
            .map(|&(log, stamp)| seconds_between(log, stamp))
            .collect();
        let median_s = median(&mut offsets_s)?;
        let mut deviations: Vec<f64> = offsets_s.iter().map(|s| (s - median_s).abs()).collect();
        Some(StampOffset {
            min_s: seconds_between(0, least),
            median_s,
            max_s: seconds_between(0, largest),
            mad_s: median(&mut deviations)?,
            drift_ppm: line.slope * 1e6,
            drift_sigma_ppm: line.slope_sigma * 1e6,
            jitter_s: SIGMA_BY_MAD * line.mad_s,
        })
    }
}
