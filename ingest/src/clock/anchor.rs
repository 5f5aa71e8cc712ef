//! Finds the clock that most topics share, and its mapping to the log time.

use super::{
    line::{Line, few, few_of, median_ns},
    stamp::StampSource,
    time::seconds_between,
};

/// Clocks further apart are different: larger than any transport delay (ns).
pub(super) const ONE_CLOCK_NS: i64 = 1_000_000_000;
/// Largest difference in rate between topics of one clock.
const ONE_PACE: f64 = 50e-6;
/// Largest deviation of a knot for which one straight line describes the offset (ns).
const STRAIGHT_NS: i64 = 2_000_000;
/// Messages between two knots, and the largest number of knots.
const MESSAGES_A_KNOT: usize = 50;
const MOST_KNOTS: usize = 512;

/// The clock of a topic, as an offset to the log time.
#[derive(Debug, Clone)]
pub(super) struct Clock {
    pub(super) line: Line,
    /// The first and the last log time.
    pub(super) log_span_ns: (i64, i64),
    /// Log times and offsets of the messages that the line was fitted to.
    pub(super) points: Vec<(i64, i64)>,
}

impl Clock {
    /// Fits the clock of a topic to its stamps; `None` without any.
    pub(super) fn of(
        stamps: impl Iterator<Item = Option<i64>> + Clone,
        log_ns: &[i64],
    ) -> Option<Self> {
        let all = offsets(stamps, log_ns);
        let points = few(all.clone());
        let extremes = |(least, largest): (i64, i64), (log, _)| (least.min(log), largest.max(log));
        Self::through(points, || all.fold((i64::MAX, i64::MIN), extremes))
    }

    /// Fits the clock of a topic to its stamps, of which none is missing; `None` without any. Gives what [`of`](Self::of) gives,
    /// without a look at every stamp.
    pub(super) fn of_complete(stamps_ns: &[i64], log_ns: &[i64]) -> Option<Self> {
        let count = stamps_ns.len().min(log_ns.len());
        let point = |index: usize| {
            let log = log_ns[index];
            (log, stamps_ns[index].saturating_sub(log))
        };
        let points = few_of(count).map(point).collect();
        let log_ns = &log_ns[..count];
        Self::through(points, || {
            let least = log_ns.iter().copied().fold(i64::MAX, i64::min);
            (least, log_ns.iter().copied().fold(i64::MIN, i64::max))
        })
    }

    fn through(points: Vec<(i64, i64)>, log_span_ns: impl FnOnce() -> (i64, i64)) -> Option<Self> {
        let line = Line::through(points.iter().copied())?;
        Some(Self {
            line,
            log_span_ns: log_span_ns(),
            points,
        })
    }

    /// The first and the last stamp of its points.
    pub(super) fn stamp_span_ns(&self) -> (i64, i64) {
        let stamps = (self.points.iter()).map(|&(log, offset)| log.saturating_add(offset));
        stamps.fold((i64::MAX, i64::MIN), |(least, largest), stamp| {
            (least.min(stamp), largest.max(stamp))
        })
    }

    /// Returns the time by which this clock is ahead of another one, in the middle of the time span that both cover (ns).
    fn ahead_of(&self, other: &Self) -> i64 {
        let from = self.log_span_ns.0.max(other.log_span_ns.0);
        let to = self.log_span_ns.1.min(other.log_span_ns.1);
        let middle = from / 2 + to / 2;
        self.line.at(middle).saturating_sub(other.line.at(middle))
    }

    fn is_one_with(&self, other: &Self) -> bool {
        self.ahead_of(other).unsigned_abs() <= ONE_CLOCK_NS.unsigned_abs()
    }

    fn has_pace_of(&self, other: &Self) -> bool {
        let sigma = self.line.slope_sigma.hypot(other.line.slope_sigma);
        (self.line.slope - other.line.slope).abs() <= ONE_PACE + 5.0 * sigma
    }
}

/// The clock of a topic whose stamps of one source are complete and never restart. To fit it anew would cost as much
/// as to decode some thousand messages.
#[derive(Debug, Clone)]
pub(crate) struct ClockFit {
    source: StampSource,
    clock: Clock,
}

impl ClockFit {
    pub(super) fn new(source: StampSource, clock: Clock) -> Self {
        Self { source, clock }
    }

    /// The clock, if it was fitted to stamps of this source.
    pub(super) fn by(self, source: StampSource) -> Option<Clock> {
        (self.source == source).then_some(self.clock)
    }
}

/// Log time of each stamped message, and stamp minus log time (ns).
pub(super) fn offsets(
    stamps: impl Iterator<Item = Option<i64>> + Clone,
    log_ns: &[i64],
) -> impl Iterator<Item = (i64, i64)> + Clone {
    stamps
        .zip(log_ns)
        .filter_map(|(stamp, &log)| Some((log, stamp?.saturating_sub(log))))
}

/// Chooses the clock that agrees with most others; among those the one with the most common rate,
/// or else the rate closest to the recorder's. The first of equals wins. A topic whose clock steps is chosen where no
/// other agrees with it.
pub(super) fn choose(clocks: &[(usize, Clock)], steps: impl Fn(usize) -> bool) -> Option<usize> {
    let with = |clock: &Clock| clocks.iter().filter(|(_, c)| c.is_one_with(clock)).count();
    let largest = clocks.iter().map(|(_, clock)| with(clock)).max()?;
    let (_, middle) = clocks.iter().find(|(_, clock)| with(clock) == largest)?;
    let mut members: Vec<&(usize, Clock)> = (clocks.iter())
        .filter(|(_, clock)| clock.is_one_with(middle))
        .collect();
    if members.iter().any(|(topic, _)| !steps(*topic)) {
        members.retain(|(topic, _)| !steps(*topic));
    }
    let same_pace = |clock: &Clock| members.iter().filter(|(_, c)| c.has_pace_of(clock)).count();
    let most = members.iter().map(|(_, clock)| same_pace(clock)).max()?;
    let best = members
        .iter()
        .filter(|(_, clock)| same_pace(clock) == most)
        .min_by(|(_, a), (_, b)| {
            // rates that agree count as equal, so that the first topic wins
            let distance = |clock: &Clock| (clock.line.slope.abs() / ONE_PACE).round();
            distance(a).total_cmp(&distance(b))
        });
    best.map(|(topic, _)| *topic)
}

/// The offset from log time to the anchor's clock.
#[derive(Debug, Clone)]
pub(super) struct LogMap {
    pub(super) line: Line,
    /// Knots (log time, offset) where one straight line is not enough; else empty.
    knots: Vec<(i64, i64)>,
}

impl LogMap {
    /// The mapping of the log time to itself.
    pub(super) const IDENTITY: Self = Self {
        line: Line::SAME,
        knots: Vec::new(),
    };

    /// A constant offset (ns).
    pub(super) const fn constant(offset_ns: i64) -> Self {
        Self::of_line(Line::constant(offset_ns))
    }

    /// Returns the map by a straight line alone.
    pub(super) const fn of_line(line: Line) -> Self {
        Self {
            line,
            knots: Vec::new(),
        }
    }

    /// Builds the map from pairs of log time and offset.
    pub(super) fn through(line: Line, points: impl Iterator<Item = (i64, i64)> + Clone) -> Self {
        let knots = match points.clone().is_sorted() {
            // as a rule; a copy of all points would cost more than the knots
            true => knots(points),
            false => {
                let mut sorted: Vec<(i64, i64)> = points.collect();
                sorted.sort_unstable();
                knots(sorted.into_iter())
            }
        };
        let is_off = |&(log, offset): &(i64, i64)| {
            line.at(log).abs_diff(offset) > STRAIGHT_NS.unsigned_abs()
        };
        let is_straight = !knots.iter().any(is_off);
        Self {
            line,
            knots: if is_straight { Vec::new() } else { knots },
        }
    }

    /// The offset at a log time (ns): linear between knots, extrapolated beyond the ends.
    pub(super) fn at(&self, log_ns: i64) -> i64 {
        let next = self.knots.partition_point(|knot| knot.0 < log_ns);
        let last = self.knots.len().saturating_sub(1);
        let after = next.clamp(1, last.max(1));
        let Some(&[a, b]) = self.knots.get(after - 1..=after) else {
            return self.line.at(log_ns);
        };
        let share = seconds_between(a.0, log_ns) / seconds_between(a.0, b.0);
        a.1.saturating_add((share * b.1.saturating_sub(a.1) as f64).round() as i64)
    }
}

/// The median offset of each group of consecutive points, at its middle.
fn knots(points: impl Iterator<Item = (i64, i64)> + Clone) -> Vec<(i64, i64)> {
    let size = MESSAGES_A_KNOT.max(points.clone().count().div_ceil(MOST_KNOTS));
    let mut knots = Vec::new();
    let mut group: Vec<(i64, i64)> = Vec::with_capacity(size);
    let mut add = |group: &mut Vec<(i64, i64)>| {
        let mut offsets: Vec<i64> = group.iter().map(|point| point.1).collect();
        if let Some(offset) = median_ns(&mut offsets) {
            knots.push((group[group.len() / 2].0, offset));
        }
        group.clear();
    };
    for point in points {
        group.push(point);
        if group.len() == size {
            add(&mut group);
        }
    }
    add(&mut group);
    knots.dedup_by_key(|knot| knot.0);
    knots
}
