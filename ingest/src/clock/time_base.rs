//! The common clock of a log.

use super::{
    anchor::{self, Clock, ClockFit, LogMap},
    describe,
    finding::ClockFinding,
    line::{Line, median_ns},
    log_jumps::{self, LogJump},
    own_clock::OwnClock,
    restarts::{self, CommonRestart, Pause, Restart, TOGETHER_NS},
    stamp::StampSource,
    stamp_steps,
    statistics::TopicStatistics,
    times::Times,
};
use crate::{file::Format, log::Log};

/// The clock of most stamped topics of a log; without stamps the publish time, else the log time.
///
/// Topics on other clocks are mapped to it through the log time, see [`place`](Self::place).
#[derive(Debug, Clone)]
pub struct TimeBase {
    pub(super) source: StampSource,
    /// The topic that defines the clock; `None` if it is the log time.
    pub(super) anchor: Option<String>,
    /// The first and the last stamp of that topic.
    pub(super) anchor_span_ns: Option<(i64, i64)>,
    /// Maps log times to this clock.
    pub(super) map: LogMap,
    /// Maps publish times to this clock, where they differ from the log times.
    pub(super) from_publish: Option<Line>,
    /// Jumps of the recorder's clock, in the order of the file.
    pub(super) log_jumps: Vec<LogJump>,
    pub(super) restarts: Vec<CommonRestart>,
    pub(super) without_publish: Option<Format>,
    /// Findings about this clock.
    pub(super) findings: Vec<ClockFinding>,
}

impl TimeBase {
    /// The common clock of these topics, each with its name.
    pub fn of(log: &Log, topics: &[(&str, &Times, &TopicStatistics)]) -> Self {
        Self::with_fits(log, topics).0
    }

    /// The common clock, and of each topic the fit of its own clock, if [`place`](Self::place) would make the same
    /// one again.
    pub(crate) fn with_fits(
        log: &Log,
        topics: &[(&str, &Times, &TopicStatistics)],
    ) -> (Self, Vec<Option<ClockFit>>) {
        let without_publish = Some(log.format()).filter(|format| !format.has_publish_time());
        let log_jumps = log_jumps::in_common(topics);
        let clocks: Vec<OwnClock<'_>> = topics
            .iter()
            .map(|(_, times, statistics)| {
                OwnClock::of(times, statistics, without_publish, &log_jumps)
            })
            .collect();
        let restarts = merged(&clocks);
        let shifts: Vec<Vec<(usize, i64)>> = (clocks.iter())
            .map(|clock| {
                let restarts = restarts::shifts(&clock.restarts, &restarts);
                stamp_steps::joined(&restarts, &clock.step_shifts(&restarts, None))
            })
            .collect();
        let mut base = Self {
            source: StampSource::Log,
            anchor: None,
            anchor_span_ns: None,
            map: LogMap::IDENTITY,
            from_publish: None,
            log_jumps,
            restarts,
            without_publish,
            findings: Vec::new(),
        };
        let mut fits = vec![None; topics.len()];
        base.find_anchor(topics, &clocks, &shifts, &mut fits);
        let times: Vec<&Times> = clocks.iter().map(|clock| &*clock.times).collect();
        base.findings = describe::of_base(base.source, &base.map, &times, clock_topic(log));
        base.findings
            .extend(describe::log_jumps(&base.log_jumps, base.source));
        (base, fits)
    }

    fn find_anchor(
        &mut self,
        topics: &[(&str, &Times, &TopicStatistics)],
        clocks: &[OwnClock<'_>],
        shifts: &[Vec<(usize, i64)>],
        fits: &mut [Option<ClockFit>],
    ) {
        let unrolled = |topic: usize| clocks[topic].shifted(&shifts[topic]);
        for source in [StampSource::Header, StampSource::Publish] {
            let found: Vec<(usize, Clock)> = (clocks.iter().enumerate())
                .filter(|(_, clock)| clock.decision.source == source)
                .filter_map(|(topic, clock)| {
                    let log_ns = clock.times.log_ns();
                    let is_plain = shifts[topic].is_empty() && clock.strays.indices.is_empty();
                    let stamps = clock.stamps();
                    let clock = match stamps.complete().filter(|_| is_plain) {
                        Some(stamps_ns) => {
                            let clock = Clock::of_complete(stamps_ns, log_ns)?;
                            fits[topic] = Some(ClockFit::new(source, clock.clone()));
                            clock
                        }
                        None => Clock::of(unrolled(topic), log_ns)?,
                    };
                    Some((topic, clock))
                })
                .collect();
            let steps = |topic: usize| !clocks[topic].steps.is_empty();
            let Some(topic) = anchor::choose(&found, steps) else {
                continue;
            };
            let Some((_, clock)) = found.iter().find(|(of, _)| *of == topic) else {
                continue;
            };
            let (name, _, statistics) = topics[topic];
            let times = &clocks[topic].times;
            let stamps = || unrolled(topic);
            let points = anchor::offsets(stamps(), times.log_ns());
            let map = LogMap::through(clock.line, points);
            let tells_publish = source == StampSource::Header && statistics.has_publish_times();
            let from_publish = tells_publish.then(|| line_from_publish(stamps(), times));
            self.source = source;
            self.anchor = Some(name.to_owned());
            self.anchor_span_ns = Some(clock.stamp_span_ns());
            self.map = map;
            self.from_publish = from_publish.flatten();
            return;
        }
    }

    /// The time source.
    pub fn source(&self) -> StampSource {
        self.source
    }

    /// Returns the topic that defines the clock; `None` where it is the log time.
    pub fn anchor(&self) -> Option<&str> {
        self.anchor.as_deref()
    }
}

fn line_from_publish(
    stamps: impl Iterator<Item = Option<i64>> + Clone,
    times: &Times,
) -> Option<Line> {
    let both = stamps.zip(times.by(StampSource::Publish).iter());
    Line::through(both.filter_map(|(stamp, publish)| {
        let publish = publish?;
        Some((publish, stamp?.saturating_sub(publish)))
    }))
}

/// The name of the topic on which a simulation publishes its time.
fn clock_topic(log: &Log) -> Option<&str> {
    let is_clock =
        |type_name: &str| type_name.starts_with("rosgraph_msgs/") && type_name.ends_with("/Clock");
    let topic = log.topics().iter().find(|topic| is_clock(&topic.type_name));
    topic.map(|topic| topic.name.as_str())
}

/// Merges the restarts of all topics: simultaneous ones get one shift, so that the topics stay
/// aligned.
fn merged(topics: &[OwnClock<'_>]) -> Vec<CommonRestart> {
    let mut all: Vec<(usize, Restart)> = (topics.iter().enumerate())
        .flat_map(|(topic, clock)| clock.restarts.iter().map(move |r| (topic, *r)))
        .collect();
    all.sort_by_key(|(_, restart)| restart.log_time_ns);
    let mut rest = all.as_slice();
    let mut common = Vec::new();
    while let Some((_, first)) = rest.first() {
        let end = first.log_time_ns.saturating_add(TOGETHER_NS);
        let count = rest.partition_point(|(_, restart)| restart.log_time_ns <= end);
        let (together, later) = rest.split_at(count);
        rest = later;
        let mut shifts: Vec<i64> = together.iter().map(|(_, r)| r.shift_ns).collect();
        let goes_on = |(topic, clock): (usize, &OwnClock<'_>)| {
            let log_ns = clock.times.log_ns();
            let (Some(&from), Some(&to)) = (log_ns.first(), log_ns.last()) else {
                return false;
            };
            from < first.log_time_ns && end < to && together.iter().all(|(t, _)| *t != topic)
        };
        let last_before = together.iter().filter_map(|(topic, restart)| {
            let before = restart.index.checked_sub(1)?;
            topics[*topic].times.log_ns().get(before).copied()
        });
        let apart_ns = last_before
            .max()
            .map_or(0, |last| first.log_time_ns.saturating_sub(last).max(0));
        common.push(CommonRestart {
            log_time_ns: first.log_time_ns,
            shift_ns: median_ns(&mut shifts).unwrap_or(0),
            is_whole: !topics.iter().enumerate().any(goes_on),
            pause_ns: match apart_ns < Pause::LEAST_NS {
                true => Pause::LEAST_NS,
                false => 0,
            },
        });
    }
    common
}
