//! The clock of one topic, before it is compared with others.

use std::borrow::Cow;

use tipwatch_language::{named, say};

use super::{
    anchor::ONE_CLOCK_NS,
    line::median_ns,
    log_jumps::{self, LogJump},
    placement::IMPOSSIBLE_NS,
    restarts::{self, MOST_RESTARTS, Restart},
    stamp::{StampDecision, StampSource},
    stamp_steps::{self, MOST_STEPS, StampStep, Stamped},
    statistics::TopicStatistics,
    strays::{self, Strays},
    time::NS_PER_S,
    times::{Stamps, Times, shift_at},
};
use crate::file::Format;

/// Stamps whose offsets to the log times differ by less do not step (ns).
const LEAST_OFFSETS_NS: i64 = 20_000_000;

/// The time source of a topic, and where its clock restarts or steps.
pub(super) struct OwnClock<'t> {
    pub(super) decision: StampDecision,
    /// The times as recorded, but for jumps of the log time, which are removed.
    pub(super) times: Cow<'t, Times>,
    /// The first message after each jump of the log time.
    pub(super) log_places: Vec<usize>,
    /// Shifts of the log times, from each jump on: the first message, and the shift (ns).
    pub(super) log_shifts: Vec<(usize, i64)>,
    pub(super) strays: Strays,
    pub(super) restarts: Vec<Restart>,
    pub(super) steps: Vec<StampStep>,
}

impl<'t> OwnClock<'t> {
    pub(super) fn of(
        times: &'t Times,
        statistics: &TopicStatistics,
        without_publish: Option<Format>,
        log_jumps: &[LogJump],
    ) -> Self {
        let log_places = log_jumps::places(times, statistics, log_jumps);
        let log_shifts = log_jumps::shifts(&log_places, log_jumps);
        let mut clock = Self {
            decision: statistics.decide_in(without_publish),
            times: match log_shifts.is_empty() {
                true => Cow::Borrowed(times),
                false => Cow::Owned(times.with_log_shifted(&log_shifts)),
            },
            log_places,
            log_shifts,
            strays: Strays::default(),
            restarts: Vec::new(),
            steps: Vec::new(),
        };
        clock.analyse(statistics);
        let several = clock.several_clocks(statistics);
        let is_several = several.is_some();
        let Some(against) = several.or_else(|| clock.why_unusable()) else {
            return clock;
        };
        let source = match statistics.has_publish_times() && !is_several {
            true if clock.decision.source == StampSource::Header => StampSource::Publish,
            _ => StampSource::Log,
        };
        let reason = format!("{} {against}", named(&clock.decision.source.to_string()));
        clock.decision = StampDecision { source, reason };
        clock.analyse(statistics);
        if clock.restarts.len() > MOST_RESTARTS {
            clock.restarts.clear();
        }
        clock
    }

    /// The chosen times as recorded.
    pub(super) fn stamps(&self) -> Stamps<'_> {
        self.times.by(self.decision.source)
    }

    /// Finds the anomalies of the times of the chosen source.
    fn analyse(&mut self, statistics: &TopicStatistics) {
        let source = self.decision.source;
        let period_s = statistics.steps(source).period_s();
        let period_ns = period_s.map_or(0, |(period_s, _)| (period_s * NS_PER_S) as i64);
        let stamps = self.times.by(source);
        let log_ns = self.times.log_ns();
        // as a rule; spares a look at every stamp
        let advances = match source {
            StampSource::Log => statistics.steps(source).backward == 0,
            _ => statistics.advances(source, restarts::LEAST_LEAP_NS),
        };
        self.strays = match advances {
            true => Strays::default(),
            false => {
                // those farther from the log time are found by it
                let most_ns = match source {
                    StampSource::Log => i64::MAX,
                    _ => IMPOSSIBLE_NS,
                };
                Strays::find(stamps, period_ns, most_ns)
            }
        };
        self.restarts = match source {
            // jumps of the recorder's clock are removed already
            StampSource::Log => Vec::new(),
            _ if advances => Vec::new(),
            StampSource::Header | StampSource::Publish => {
                restarts::find(stamps, &self.strays, log_ns, &self.log_places)
            }
        };
        let may_step = source == StampSource::Header
            && statistics
                .header_minus_log_ns()
                .is_some_and(|(least, largest)| largest.saturating_sub(least) >= LEAST_OFFSETS_NS);
        self.steps = Vec::new();
        if may_step && self.restarts.len() <= MOST_RESTARTS {
            let continued = restarts::own_shifts(&self.restarts);
            let at = |index: usize| {
                let stamp_ns = stamps.at(index).filter(|_| !self.strays.contains(index))?;
                Some(Stamped {
                    log_ns: log_ns[index],
                    stamp_ns: stamp_ns.saturating_add(shift_at(&continued, index)),
                })
            };
            self.steps = stamp_steps::find(stamps.len(), at, period_ns);
        }
    }

    /// Describes the evidence that publishers with clocks of their own share the topic: its stamps go back again and again, by
    /// more than any transport delays a message.
    fn several_clocks(&self, statistics: &TopicStatistics) -> Option<String> {
        let source = self.decision.source;
        let messages = self.times.len();
        let are_many = |count: usize| count * strays::MOST_SHARE > messages;
        if source == StampSource::Log || !are_many(statistics.steps(source).backward) {
            return None;
        }
        let times: Vec<i64> = self.stamps().iter().flatten().collect();
        let steps = times.windows(2).map(|pair| pair[0].saturating_sub(pair[1]));
        let mut back: Vec<i64> = steps.filter(|step| *step > ONE_CLOCK_NS).collect();
        let count = back.len();
        let usual_s = median_ns(&mut back)? as f64 / NS_PER_S;
        are_many(count).then(|| {
            say!(
                "goes back in {count} of {messages} messages, as a rule by {usual_s:.3} s: publishers with clocks of their own share the topic"
            )
        })
    }

    fn why_unusable(&self) -> Option<String> {
        if self.decision.source == StampSource::Log {
            return None;
        }
        let (strays, messages) = (self.strays.indices.len(), self.times.len());
        if self.strays.are_many(messages) {
            return Some(say!(
                "is ahead of its own course in {strays} of {messages} messages"
            ));
        }
        if self.restarts.len() > MOST_RESTARTS {
            return Some(say!("restarts {} times", self.restarts.len()));
        }
        let steps = self.steps.len();
        (steps > MOST_STEPS).then(|| say!("steps {steps} times while the log time does not"))
    }

    /// The stamps without strays, with these shifts added.
    pub(super) fn shifted<'a>(
        &'a self,
        shifts: &'a [(usize, i64)],
    ) -> impl Iterator<Item = Option<i64>> + Clone + 'a {
        let all = restarts::unrolled(self.stamps(), shifts).enumerate();
        all.map(|(index, stamp)| stamp.filter(|_| !self.strays.contains(index)))
    }

    /// The shifts that undo the steps, given those that undo the restarts. The course is taken as right whose offset to
    /// the log time is closest to that which `expected_ns` gives for a log time; the longest where none is close.
    pub(super) fn step_shifts(
        &self,
        restarts: &[(usize, i64)],
        expected_ns: Option<&dyn Fn(i64) -> i64>,
    ) -> Vec<(usize, i64)> {
        if self.steps.is_empty() {
            return Vec::new();
        }
        let (stamps, log_ns) = (self.stamps(), self.times.log_ns());
        let starts = std::iter::once(0).chain(self.steps.iter().map(|step| step.index));
        let ends = self.steps.iter().map(|step| step.index);
        let ends = ends.chain(std::iter::once(stamps.len()));
        let courses: Vec<(usize, usize)> = starts.zip(ends).collect();
        let off_ns = |&(from, to): &(usize, usize)| {
            let expected_ns = expected_ns?;
            let off = |index: usize| {
                let stamp = stamps.at(index).filter(|_| !self.strays.contains(index))?;
                let stamp = stamp.saturating_add(shift_at(restarts, index));
                let offset = stamp.saturating_sub(log_ns[index]);
                Some(offset.saturating_sub(expected_ns(log_ns[index])))
            };
            let mut all: Vec<i64> = (from..to).filter_map(off).collect();
            median_ns(&mut all).map(i64::unsigned_abs)
        };
        let offs = courses.iter().map(off_ns).enumerate();
        let offs = offs.filter_map(|(course, off)| Some((off?, course)));
        let nearest = offs
            .min()
            .filter(|(off, _)| *off <= ONE_CLOCK_NS.unsigned_abs());
        let longest = || {
            courses
                .iter()
                .enumerate()
                .max_by_key(|(_, (from, to))| to - from)
        };
        let right = match nearest {
            Some((_, course)) => course,
            None => longest().map_or(0, |(course, _)| course),
        };
        stamp_steps::shifts(&self.steps, right)
    }
}
