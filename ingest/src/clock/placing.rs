//! Maps the stamps of a topic to the clock of its log.

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_language::{named, say, word};

use super::{
    anchor::{Clock, ClockFit, LogMap, ONE_CLOCK_NS},
    describe,
    finding::{ClockFinding, ClockFindingKind as Kind},
    line::{Line, SIGMA_BY_MAD, median_ns},
    own_clock::OwnClock,
    placement::{Correction, Placement, is_possible_offset, off_ns},
    restarts::{Pause, shifts},
    stamp::{StampDecision, StampSource},
    stamp_steps,
    statistics::TopicStatistics,
    time::{NS_PER_S, seconds_between},
    time_base::TimeBase,
    times::{MessageTimes, Times},
};

/// Clocks further apart have different epochs (s).
const OTHER_EPOCH_S: f64 = 3600.0;
/// A drift that adds up to less over the log is ignored (s).
const LEAST_DRIFT_S: f64 = 0.02;
/// Shorter spans do not determine a drift (s).
const LEAST_SPAN_S: f64 = 5.0;
/// A drift counts if it exceeds this many standard deviations.
const DRIFT_SIGMAS: f64 = 5.0;
/// Log times with more scatter about a topic's clock cannot place it (s).
const MOST_SCATTER_S: f64 = 0.1;

/// Topics of one recording whose stamps begin and end within this time of each other show one clock (s), where the log
/// times show nothing, as in a replay as fast as possible on a busy computer.
const MOST_SPAN_APART_S: f64 = 0.1;

/// What was done to the stamps of a topic.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct StampCorrection {
    /// Median offset added (s), without restarts.
    pub added_s: f64,
    /// Drift removed (ppm).
    pub drift_removed_ppm: f64,
    /// Number of restarts of the topic's clock.
    pub restarts: usize,
    /// Corrections of the topic's clock that are undone.
    pub steps: usize,
    /// Jumps of the recorder's clock that are undone.
    pub log_time_jumps: usize,
}

/// A topic on the clock of its log.
#[derive(Debug, Clone)]
pub struct Placed {
    /// Placement of the samples on that clock.
    pub placement: Placement,
    /// The time source, and why it was chosen.
    pub clock: StampDecision,
    /// Correction of the stamps.
    pub correction: StampCorrection,
    /// Anomalies of the stamps.
    pub findings: Vec<ClockFinding>,
}

impl TimeBase {
    /// Puts a topic's samples on this clock.
    ///
    /// Stamps of the same clock stay unchanged. Others are shifted as a whole, so that their offset
    /// to the log times equals that of the anchor topic; drift is removed the same way. Messages
    /// without stamps get their publish or log time, shifted likewise.
    pub fn place(&self, name: &str, times: &Times, statistics: &TopicStatistics) -> Placed {
        self.place_fitted(name, times, statistics, None)
    }

    /// Like [`place`](Self::place), given the fit of the topic's clock by [`with_fits`](Self::with_fits).
    pub(crate) fn place_fitted(
        &self,
        name: &str,
        times: &Times,
        statistics: &TopicStatistics,
        fit: Option<ClockFit>,
    ) -> Placed {
        let own = OwnClock::of(times, statistics, self.without_publish, &self.log_jumps);
        let mut shifts = shifts(&own.restarts, &self.restarts);
        let is_anchor = self.anchor() == Some(name);
        // other topics tell when the stamps of this one are right
        let expected_ns = |log_ns: i64| self.map.at(log_ns);
        let expected_ns: Option<&dyn Fn(i64) -> i64> = match is_anchor {
            true => None,
            false => Some(&expected_ns),
        };
        let steps = own.step_shifts(&shifts, expected_ns);
        shifts = stamp_steps::joined(&shifts, &steps);
        let mut placed = Placed {
            placement: Placement {
                source: own.decision.source,
                log_shifts: own.log_shifts.clone(),
                shifts,
                strays: own.strays.indices.clone(),
                expected: None,
                correction: Correction::None,
                pauses: Vec::new(),
            },
            correction: StampCorrection {
                restarts: own.restarts.len(),
                steps: own.steps.len(),
                log_time_jumps: own.log_places.len(),
                ..StampCorrection::default()
            },
            findings: describe::of_topic(statistics, &own, &steps, &self.restarts),
            clock: own.decision.clone(),
        };
        let source = placed.clock.source;
        if source > self.source {
            self.place_worse_time(&mut placed, &own.times, statistics);
        } else if source != StampSource::Log {
            let clock = leave_out_impossible(&mut placed, times, &own, statistics, fit);
            if let Some(clock) = clock.filter(|_| !is_anchor) {
                self.place_own_clock(&mut placed, &clock);
            }
        } else if !times.is_empty() {
            placed
                .findings
                .push(describe::only_log_times(&placed.clock));
        }
        placed.findings.extend(self.findings.iter().cloned());
        placed.placement.pauses = Pause::of(&own.restarts, &self.restarts);
        if self.source == StampSource::Log {
            let jumps = own.log_places.iter().zip(&self.log_jumps);
            let unknown = jumps.filter(|(_, jump)| !jump.wraps);
            let pauses = unknown.map(|(&place, _)| Pause::before(place));
            placed.placement.pauses.extend(pauses);
        }
        placed
    }

    /// Places a topic with stamps of this or another clock.
    fn place_own_clock(&self, placed: &mut Placed, clock: &Clock) {
        let points = &clock.points;
        let apart = |&(log, offset): &(i64, i64)| (log, offset.saturating_sub(self.map.at(log)));
        let Some(line) = Line::through(points.iter().map(apart)) else {
            return;
        };
        let (from, to) = clock.log_span_ns;
        let middle = from / 2 + to / 2;
        let apart_ns = line.at(middle);
        let is_other = apart_ns.unsigned_abs() > ONE_CLOCK_NS.unsigned_abs();
        let drifts = drifts(&line);
        if !is_other && !drifts {
            return;
        }
        let anchor = self.anchor().unwrap_or(word!("the log time")).to_owned();
        let seen = describe::seen_apart(&anchor, is_other, apart_ns, drifts.then_some(&line));
        let kind = match seconds_between(0, apart_ns).abs() {
            _ if !is_other => Kind::ClockDrift,
            apart_s if apart_s > OTHER_EPOCH_S => Kind::OtherEpoch,
            _ => Kind::ClockApart,
        };
        if let Some(reason) = why_log_times_do_not_tell(&line, from == to && points.len() > 1) {
            if let Some(apart_s) = self
                .span_differs_s(clock)
                .filter(|s| *s <= MOST_SPAN_APART_S)
            {
                let done = say!(
                    "its stamps are used as they are: {reason}, but its stamps begin and end with those of {anchor}, \
                     to within {:.0} ms",
                    apart_s * 1e3
                );
                placed
                    .findings
                    .push(ClockFinding::reported(kind, seen, done));
                return;
            }
            placed.placement.correction = Correction::Refused;
            let done = say!("its samples cannot be used: {reason}");
            placed
                .findings
                .push(ClockFinding::refused(kind, seen, done));
            return;
        }
        placed.placement.correction = match drifts {
            true => Correction::Drifting(line),
            false => Correction::Ahead(apart_ns),
        };
        placed.correction.added_s = -seconds_between(0, apart_ns);
        placed.correction.drift_removed_ppm = if drifts { line.slope * 1e6 } else { 0.0 };
        let scatter_ms = SIGMA_BY_MAD * line.mad_s * 1e3;
        let done = say!(
            "mapped to the clock of {anchor} through the log time, assuming equal transport delays; their difference, \
             usually some milliseconds, remains as an error (log times scatter by {scatter_ms:.1} ms)"
        );
        placed
            .findings
            .push(ClockFinding::handled(kind, seen, done));
    }

    /// Returns the difference of the first or the last stamp of a clock from that of the anchor, whichever is larger (s).
    fn span_differs_s(&self, clock: &Clock) -> Option<f64> {
        let (from, to) = self.anchor_span_ns?;
        let (own_from, own_to) = clock.stamp_span_ns();
        let apart = |a: i64, b: i64| seconds_between(a, b).abs();
        Some(apart(from, own_from).max(apart(to, own_to)))
    }

    /// Places a topic with only publish or log times, shifted to the time of a stamp: on average its own stamps have it, where
    /// they are only out of order.
    fn place_worse_time(&self, placed: &mut Placed, times: &Times, statistics: &TopicStatistics) {
        let source = named(&placed.clock.source.to_string());
        let seen = say!("{source} is used: {}", placed.clock.reason);
        let by_publish = match placed.clock.source {
            StampSource::Publish if self.log_jumps.is_empty() => self.from_publish,
            _ => None,
        };
        let own = (statistics.is_disordered())
            .then(|| self.own_offset(times, by_publish.is_some()))
            .flatten();
        let by_publish = by_publish.map(|line| own.unwrap_or(line));
        let by_log = own.map_or_else(|| self.map.clone(), LogMap::of_line);
        let added = times.iter().map(|times| match by_publish {
            Some(line) => line.at(times.publish_time_ns),
            None => by_log.at(times.log_time_ns),
        });
        let mut added: Vec<i64> = added.collect();
        placed.placement.correction = match by_publish {
            Some(line) => Correction::Published(line),
            None => Correction::Logged(by_log),
        };
        if by_publish.is_none() {
            placed.clock.source = StampSource::Log;
        }
        let added_s = seconds_between(0, median_ns(&mut added).unwrap_or(0));
        placed.correction.added_s = added_s;
        let done = say!(
            "mapped to the clock of {} by adding {added_s:.4} s, the offset of its stamps to that time",
            self.anchor().unwrap_or(word!("the others"))
        );
        placed
            .findings
            .push(ClockFinding::handled(Kind::NoHeaderStamp, seen, done));
    }

    /// The offset of a topic's header stamps to its publish or log times, if they are of this clock.
    fn own_offset(&self, times: &Times, by_publish: bool) -> Option<Line> {
        let at_ns = |times: &MessageTimes| match by_publish {
            true => times.publish_time_ns,
            false => times.log_time_ns,
        };
        let stamped = times.iter().filter_map(|times| {
            let at_ns = at_ns(&times);
            Some((at_ns, times.header_stamp_ns?.saturating_sub(at_ns)))
        });
        let line = Line::through(stamped)?;
        let log_ns = *times.log_ns().first()?;
        let apart_ns = line.at(log_ns).saturating_sub(self.map.at(log_ns));
        (apart_ns.unsigned_abs() <= ONE_CLOCK_NS.unsigned_abs()).then_some(line)
    }
}

/// Whether a clock drifts significantly, and by enough to matter.
fn drifts(line: &Line) -> bool {
    let grown_s = line.slope.abs() * line.span_s;
    line.span_s > LEAST_SPAN_S
        && grown_s > LEAST_DRIFT_S
        && grown_s > DRIFT_SIGMAS * SIGMA_BY_MAD * line.mad_s
        && line.slope.abs() > DRIFT_SIGMAS * line.slope_sigma
}

fn why_log_times_do_not_tell(line: &Line, is_constant: bool) -> Option<String> {
    if is_constant {
        return Some(word!("the log times of all its messages are equal").to_owned());
    }
    (line.mad_s > MOST_SCATTER_S).then(|| {
        say!(
            "the log times scatter by {:.2} s about its stamps",
            SIGMA_BY_MAD * line.mad_s
        )
    })
}

/// Omits single stamps far from all others, and returns the clock of the remaining ones.
fn leave_out_impossible(
    placed: &mut Placed,
    times: &Times,
    own: &OwnClock<'_>,
    statistics: &TopicStatistics,
    fit: Option<ClockFit>,
) -> Option<Clock> {
    let log_ns = own.times.log_ns();
    let is_plain = placed.placement.shifts.is_empty() && placed.placement.strays.is_empty();
    let complete = own.stamps().complete().filter(|_| is_plain);
    let clock = match complete {
        Some(stamps_ns) => match fit.and_then(|fit| fit.by(placed.placement.source)) {
            Some(clock) => clock,
            None => Clock::of_complete(stamps_ns, log_ns)?,
        },
        None => Clock::of(placed.placement.stamps(times), log_ns)?,
    };
    if placed.placement.keeps_stamps() && are_possible(&clock, statistics) {
        return Some(clock);
    }
    let mut worst_ns = 0;
    let mut count = 0;
    for (stamp, &log) in placed.placement.stamps(times).zip(log_ns) {
        if let Some(off_ns) = stamp.and_then(|stamp| off_ns(&clock.line, stamp, log)) {
            count += 1;
            if off_ns.unsigned_abs() > i64::unsigned_abs(worst_ns) {
                worst_ns = off_ns;
            }
        }
    }
    if count == 0 {
        return Some(clock);
    }
    let seen = say!(
        "{count} stamps differ by more than an hour from the value expected by log time, at most by {:.0} s",
        worst_ns as f64 / NS_PER_S
    );
    let done = word!("these messages are omitted");
    let kind = Kind::ImpossibleStamps;
    placed
        .findings
        .push(ClockFinding::handled(kind, seen, done));
    placed.placement.expected = Some(clock.line);
    Clock::of(placed.placement.stamps(times), log_ns)
}

/// Whether the extremes already show that no header stamp is impossible.
fn are_possible(clock: &Clock, statistics: &TopicStatistics) -> bool {
    let Some((least, largest)) = statistics.header_minus_log_ns() else {
        return false;
    };
    let (from, to) = clock.log_span_ns;
    // a straight line is extreme at its ends
    [from, to].into_iter().all(|log_ns| {
        let expected = clock.line.at(log_ns);
        let is_possible = |offset: i64| is_possible_offset(offset, expected);
        is_possible(least) && is_possible(largest)
    })
}
