//! How the stamps of a topic behave: rate, gaps, offsets between its clocks.

use serde::Serialize;

use crate::clock::{StampDecision, StampEvidence, StampSource};

/// Stands for a header without a stamp. No clock shows it: it is 292 years before its zero.
const NO_STAMP: i64 = i64::MIN;
const NS_PER_S: f64 = 1e9;
/// A pause shorter than this is no gap, however fast the topic.
const SHORTEST_GAP_S: f64 = 0.1;
const GAP_PERIODS: f64 = 5.0;
/// No two clocks of one machine that mean the same time differ by as much.
const OTHER_EPOCH_S: f64 = 3600.0;
/// Start of 1990: stamps before it are counted from the start of something.
const EARLIEST_DATE_NS: i64 = 631_152_000_000_000_000;

/// Takes note of the times of a topic's messages, one after the other.
#[derive(Debug, Clone, Default)]
pub struct TopicStatistics {
    header_ns: Vec<i64>,
    log_ns: Vec<i64>,
    /// Empty as long as it equals the log time, as it mostly does.
    publish_ns: Vec<i64>,
}

/// A pause in a topic.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gap {
    /// The last stamp before it.
    pub start_ns: i64,
    /// How long nothing came.
    pub duration_s: f64,
}

/// By how much the stamps are ahead of the log time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StampOffset {
    /// The smallest.
    pub min_s: f64,
    /// The median.
    pub median_s: f64,
    /// The largest.
    pub max_s: f64,
    /// Last minus first, for each second of log time.
    pub drift_s_per_s: f64,
}

/// How the stamps of a topic behave. Periods and stamps are those of the chosen source.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
    /// The longest time from one message to the next.
    pub max_period_s: Option<f64>,
    /// By how much the header's stamps are ahead of the log time; `None` without stamps.
    pub header_minus_log: Option<StampOffset>,
    /// Pauses longer than 0.1 s and than five median periods.
    pub gaps: Vec<Gap>,
    /// Messages with the stamp of the one before.
    pub duplicate_stamps: usize,
    /// Messages with an earlier stamp than the one before.
    pub backward_stamps: usize,
    /// Messages whose header has no stamp, or zero.
    pub zero_stamps: usize,
    /// What a reader has to know.
    pub notes: Vec<String>,
}

impl TopicStatistics {
    /// Takes note of one message.
    pub fn push(&mut self, header_stamp_ns: Option<i64>, publish_time_ns: i64, log_time_ns: i64) {
        if self.publish_ns.is_empty() && publish_time_ns != log_time_ns {
            // So far they were equal.
            self.publish_ns.extend_from_slice(&self.log_ns);
            self.publish_ns.push(publish_time_ns);
        } else if !self.publish_ns.is_empty() {
            self.publish_ns.push(publish_time_ns);
        }
        self.header_ns.push(header_stamp_ns.unwrap_or(NO_STAMP));
        self.log_ns.push(log_time_ns);
    }

    /// How many messages were noted.
    pub fn message_count(&self) -> usize {
        self.log_ns.len()
    }

    /// Which time to use.
    pub fn decide(&self) -> StampDecision {
        StampEvidence {
            messages: self.log_ns.len(),
            stamped: self.header_stamps().count(),
            header_changes: changes(self.header_stamps()),
            publish_is_apart: self.publish_ns.iter().any(|&time| time != 0),
            publish_changes: changes(self.publish_ns.iter().copied()),
        }
        .decide()
    }

    /// How the stamps behave.
    pub fn timing(&self) -> TopicTiming {
        let clock = self.decide();
        let stamps_ns = self.stamps_ns(clock.source);
        let periods = Periods::new(&stamps_ns);
        let header_minus_log = self.header_minus_log();
        let notes = self.notes(&clock, header_minus_log.as_ref());
        TopicTiming {
            clock,
            message_count: self.log_ns.len(),
            first_stamp_ns: stamps_ns.first().copied(),
            last_stamp_ns: stamps_ns.last().copied(),
            rate_hz: periods.rate_hz,
            median_period_s: periods.median_s,
            max_period_s: periods.max_s,
            header_minus_log,
            gaps: periods.gaps(&stamps_ns),
            duplicate_stamps: periods.duplicates,
            backward_stamps: periods.backward,
            zero_stamps: self.log_ns.len() - self.header_stamps().count(),
            notes,
        }
    }

    /// The stamp of each message by one clock; `None` where its header has none.
    pub(crate) fn stamp_of_each(&self, source: StampSource) -> impl Iterator<Item = Option<i64>> {
        let stamps_ns = match source {
            StampSource::Header => &self.header_ns,
            StampSource::Publish if !self.publish_ns.is_empty() => &self.publish_ns,
            StampSource::Publish | StampSource::Log => &self.log_ns,
        };
        let is_absent =
            move |stamp| source == StampSource::Header && (stamp == NO_STAMP || stamp == 0);
        stamps_ns
            .iter()
            .map(move |&stamp| (!is_absent(stamp)).then_some(stamp))
    }

    /// When the recorder received each message.
    pub(crate) fn log_times_ns(&self) -> &[i64] {
        &self.log_ns
    }

    fn header_stamps(&self) -> impl Iterator<Item = i64> {
        self.stamp_of_each(StampSource::Header).flatten()
    }

    fn stamps_ns(&self, source: StampSource) -> Vec<i64> {
        match source {
            StampSource::Header => self.header_stamps().collect(),
            StampSource::Publish => self.publish_ns.clone(),
            StampSource::Log => self.log_ns.clone(),
        }
    }

    fn header_minus_log(&self) -> Option<StampOffset> {
        let pairs = self.header_ns.iter().zip(&self.log_ns);
        let mut both = pairs.filter(|(stamp, _)| **stamp != NO_STAMP && **stamp != 0);
        let mut offsets_s: Vec<f64> = both
            .clone()
            .map(|(&stamp, &log)| seconds_between(log, stamp))
            .collect();
        let (first, last) = (*offsets_s.first()?, *offsets_s.last()?);
        let (_, &first_log) = both.clone().next()?;
        let (_, &last_log) = both.next_back()?;
        let log_span_s = seconds_between(first_log, last_log);
        let drift = if log_span_s > 0.0 {
            (last - first) / log_span_s
        } else {
            0.0
        };
        let median_s = median(&mut offsets_s)?;
        Some(StampOffset {
            min_s: offsets_s.iter().copied().fold(f64::INFINITY, f64::min),
            median_s,
            max_s: offsets_s.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            drift_s_per_s: drift,
        })
    }

    fn notes(&self, clock: &StampDecision, offset: Option<&StampOffset>) -> Vec<String> {
        let mut notes = Vec::new();
        if let Some(offset) = offset.filter(|offset| offset.median_s.abs() > OTHER_EPOCH_S) {
            let is_relative = self
                .header_stamps()
                .next()
                .is_some_and(|s| s < EARLIEST_DATE_NS);
            notes.push(if is_relative {
                "header stamps count from the start of something, such as a simulation, log times \
                 are dates"
                    .to_owned()
            } else {
                format!(
                    "header stamps and log times are in different epochs: {:.0} s apart",
                    offset.median_s
                )
            });
        }
        if clock.source != StampSource::Header {
            notes.push(format!("{} is used: {}", clock.source, clock.reason));
        }
        notes
    }
}

/// What the times from one message to the next tell.
struct Periods {
    rate_hz: Option<f64>,
    median_s: Option<f64>,
    max_s: Option<f64>,
    duplicates: usize,
    backward: usize,
}

impl Periods {
    fn new(stamps_ns: &[i64]) -> Self {
        let pairs = stamps_ns.windows(2).map(|pair| (pair[0], pair[1]));
        let mut forward_s: Vec<f64> = pairs
            .clone()
            .filter(|(before, after)| after > before)
            .map(|(before, after)| seconds_between(before, after))
            .collect();
        let total_s: f64 = forward_s.iter().sum();
        Self {
            // Backward steps do not shorten the time, duplicates do not lengthen it.
            rate_hz: (total_s > 0.0).then(|| (stamps_ns.len() - 1) as f64 / total_s),
            max_s: forward_s.iter().copied().reduce(f64::max),
            median_s: median(&mut forward_s),
            duplicates: pairs
                .clone()
                .filter(|(before, after)| after == before)
                .count(),
            backward: pairs.filter(|(before, after)| after < before).count(),
        }
    }

    fn gaps(&self, stamps_ns: &[i64]) -> Vec<Gap> {
        let longest_pause_s = (self.median_s.unwrap_or(0.0) * GAP_PERIODS).max(SHORTEST_GAP_S);
        let gap = |pair: &[i64]| Gap {
            start_ns: pair[0],
            duration_s: seconds_between(pair[0], pair[1]),
        };
        stamps_ns
            .windows(2)
            .map(gap)
            .filter(|gap| gap.duration_s > longest_pause_s)
            .collect()
    }
}

fn changes(mut stamps_ns: impl Iterator<Item = i64>) -> bool {
    let first = stamps_ns.next();
    stamps_ns.any(|stamp| Some(stamp) != first)
}

/// Subtracted as integers first: a date in nanoseconds is too large for an exact f64.
fn seconds_between(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 / NS_PER_S
}

fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len().checked_sub(1)? / 2;
    let (_, median, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*median)
}
