//! Statistics of a topic's times, in bounded memory.

use super::{
    line::{Line, SIGMA_BY_MAD, median},
    stamp::{StampDecision, StampEvidence, StampSource},
    steps::Steps,
    thinned::Thinned,
    time::{is_date, seconds_between},
    times::{Times, TimesSlice},
    timing::{StampOffset, TopicTiming},
};
use crate::file::Format;

/// Share of messages that repeat the previous stamp from which on a coarse resolution is the cause.
const COARSE_SHARE: f64 = 0.4;
/// A finer resolution is not coarse (ns).
const LEAST_COARSE_NS: i64 = 100_000_000;
/// Share of messages with an earlier stamp than the previous one from which on the stamps are out of order, not the messages.
const DISORDERED_SHARE: f64 = 0.05;
/// Messages come regularly if the median step is the mean one within this share, and steps vary by so much less than those of
/// the stamps.
const REGULAR_SHARE: f64 = 0.2;
const LESS_SCATTER: f64 = 0.5;

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
    /// Adds consecutive messages.
    pub(crate) fn extend(&mut self, times: TimesSlice<'_>) {
        let log_ns = times.log_ns();
        self.messages += log_ns.len();
        let log = |from: usize| (log_ns[from..].iter()).map(|&log_ns| (log_ns, log_ns));
        match times.apart_ns() {
            Some(publish_ns) => {
                let both = publish_ns.iter().copied().zip(log_ns.iter().copied());
                let mut equal = log_ns.len();
                if !self.publish_is_apart {
                    let first = both.clone().position(|(publish, log)| publish != log);
                    equal = first.unwrap_or(equal);
                    self.log.extend(log(0).take(equal));
                    if equal < log_ns.len() {
                        self.publish_is_apart = true;
                        self.publish = self.log.clone();
                    }
                } else {
                    equal = 0;
                }
                self.publish.extend(both.clone().skip(equal));
                self.log.extend(log(equal));
                self.publish_is_set |= publish_ns.iter().any(|&time_ns| time_ns != 0);
            }
            None => {
                if self.publish_is_apart {
                    self.publish.extend(log(0));
                }
                self.log.extend(log(0));
                self.publish_is_set |= log_ns.iter().any(|&time_ns| time_ns != 0);
            }
        }
        let stamped = || times.stamped();
        self.header.extend(stamped());
        let (mut least, mut largest) = self.header_minus_log_ns.unwrap_or((i64::MAX, i64::MIN));
        for (stamp, log) in stamped() {
            self.stamped += 1;
            self.not_dates += usize::from(!is_date(stamp));
            self.pairs.push((log, stamp));
            let offset = stamp.saturating_sub(log);
            (least, largest) = (least.min(offset), largest.max(offset));
        }
        self.header_minus_log_ns = Some((least, largest)).filter(|_| self.stamped > 0);
    }

    /// Adds one message. A header stamp of zero counts as missing.
    pub fn push(&mut self, header_stamp_ns: Option<i64>, publish_time_ns: i64, log_time_ns: i64) {
        let mut one = Times::default();
        one.push(header_stamp_ns, publish_time_ns, log_time_ns);
        self.extend(one.as_slice());
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
            header_resolution_ns: self.coarse_resolution_ns(),
            header_disorder: self.disorder(),
            publish_is_apart: self.has_publish_times(),
            publish_changes: self.steps(StampSource::Publish).changes,
            without_publish,
        }
        .decide()
    }

    /// The resolution of the header stamps (ns), if it is so coarse that many messages repeat a stamp while the log times
    /// advance.
    fn coarse_resolution_ns(&self) -> Option<i64> {
        let duplicates = self.header.duplicates;
        let repeats = duplicates as f64 >= COARSE_SHARE * self.stamped as f64;
        // the log times may be copies of the stamps
        if !repeats || 2 * self.log.duplicates > duplicates {
            return None;
        }
        let stamps = self.pairs.values().iter().map(|(_, stamp)| *stamp);
        let resolution_ns = stamps.fold(0, greatest_common_divisor);
        (resolution_ns >= LEAST_COARSE_NS).then_some(resolution_ns)
    }

    /// Returns the number of header stamps that are earlier than the one before, and the scatter of all of them (s), if the
    /// stamps are out of order and not the messages: the messages, which one sender sends in order, come in order and regularly.
    /// Messages that overtake each other come irregularly, and their stamps are right.
    fn disorder(&self) -> Option<(usize, f64)> {
        let is_disordered = self.header.backward as f64 > DISORDERED_SHARE * self.messages as f64;
        let others = match self.has_publish_times() {
            true => &self.publish,
            false => &self.log,
        };
        if !is_disordered || others.backward > 0 {
            return None;
        }
        let (_, stamped_mad_s) = self.header.period_s()?;
        let (period_s, mad_s) = others.period_s()?;
        let is_even = (others.rate_hz()? * period_s - 1.0).abs() < REGULAR_SHARE;
        let is_regular = is_even && mad_s < LESS_SCATTER * stamped_mad_s;
        let scatter_s = self
            .header_minus_log()
            .map_or(f64::NAN, |offset| offset.jitter_s);
        is_regular.then_some((self.header.backward, scatter_s))
    }

    /// Whether the header stamps are out of order though the messages are not.
    pub(super) fn is_disordered(&self) -> bool {
        self.disorder().is_some()
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

/// Returns the greatest common divisor of the absolute values, by Euclid.
fn greatest_common_divisor(a: i64, b: i64) -> i64 {
    let (mut a, mut b) = (a.saturating_abs(), b.saturating_abs());
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Statistics of messages every 4 ms whose stamps and log times are off by so many microseconds.
    fn statistics(off_us: impl Fn(i64) -> [i64; 2]) -> TopicStatistics {
        let mut statistics = TopicStatistics::default();
        for index in 0..2000 {
            let true_ns = 1_700_000_000_000_000_000 + index * 4_000_000;
            let [stamp_ns, log_ns] = off_us(index).map(|us| true_ns + 1000 * us);
            statistics.push(Some(stamp_ns), log_ns, log_ns);
        }
        statistics
    }

    /// Evenly distributed between -width and width.
    fn noise(index: i64, width: i64) -> i64 {
        let wave = ((index as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0);
        ((2.0 * wave - 1.0) * width as f64) as i64
    }

    #[test]
    fn stamps_out_of_order_yield_to_times_in_order() {
        let source = |statistics: &TopicStatistics| statistics.decide().source;
        let jittered = statistics(|k| [noise(k, 8000), 1500 + noise(7 * k, 100)]);
        assert_eq!(source(&jittered), StampSource::Log);
        // messages that overtake each other come late, and in no order
        let late = statistics(|k| [0, 9000 + noise(k, 8000)]);
        assert_eq!(source(&late), StampSource::Header);
        // stored ten at a time
        let stored = statistics(|k| [noise(k, 8000), 4000 * (9 - k % 10) + k % 10]);
        assert_eq!(source(&stored), StampSource::Header);
        let sound = statistics(|k| [noise(k, 500), 1500 + noise(7 * k, 100)]);
        assert_eq!(source(&sound), StampSource::Header);
    }

    #[test]
    fn many_messages_at_once_give_the_statistics_of_one_by_one() {
        let mut state = 5_u64;
        let mut below = |end: u64| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            ((state >> 33) % end) as i64
        };
        for apart_from in [0, 700, 5000, u64::MAX] {
            let (mut at_once, mut one_by_one) =
                (TopicStatistics::default(), TopicStatistics::default());
            let mut part = Times::default();
            let mut log_ns = 1_700_000_000_000_000_000_i64;
            for index in 0..10_000_u64 {
                log_ns += match below(50) {
                    0 => 0,
                    1 => -below(3_000_000_000),
                    2 => below(3_000_000_000),
                    _ => 9_000_000 + below(2_000_000),
                };
                let publish_ns = match index >= apart_from {
                    true => log_ns - below(1000),
                    false => log_ns,
                };
                let header_ns = match below(30) {
                    0 => None,
                    1 => Some(0),
                    2 => Some(below(1_000_000)),
                    _ => Some(log_ns - below(5_000_000)),
                };
                one_by_one.push(header_ns, publish_ns, log_ns);
                part.push(header_ns, publish_ns, log_ns);
                if below(300) == 0 {
                    at_once.extend(part.as_slice());
                    part.clear();
                }
            }
            at_once.extend(part.as_slice());
            assert_eq!(format!("{at_once:?}"), format!("{one_by_one:?}"));
        }
    }
}
