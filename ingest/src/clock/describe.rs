//! Says in words what is odd about clocks.

use super::{
    anchor::LogMap,
    finding::{ClockFinding, ClockFindingKind as Kind},
    line::{Line, median_ns},
    own_clock::OwnClock,
    restarts::CommonRestart,
    stamp::{StampDecision, StampSource},
    statistics::TopicStatistics,
    time::{EARLIEST_DATE_NS, is_date, seconds_between},
    times::Times,
};

/// No two clocks of one machine that mean the same time differ by as much (s).
const OTHER_EPOCH_S: f64 = 3600.0;
/// Nothing but a replay or a simulation changes the pace by as much.
const OTHER_PACE: f64 = 0.01;
/// A shorter time does not tell the pace (s).
const LEAST_SPAN_S: f64 = 1.0;
/// Repeated stamps below this share of the messages are not worth a word.
const REPEATED_SHARE: f64 = 0.01;

/// What is odd about a topic's own clock.
pub(super) fn of_topic(
    statistics: &TopicStatistics,
    clock: &OwnClock,
    common: &[CommonRestart],
) -> Vec<ClockFinding> {
    let mut findings = Vec::new();
    let (messages, zero) = (statistics.message_count(), statistics.zero_stamps());
    let source = clock.decision.source;
    if source == StampSource::Header && zero > 0 {
        let seen = format!("{zero} of {messages} messages have no stamp, or zero");
        findings.push(ClockFinding::handled(
            Kind::ZeroStamps,
            seen,
            "those messages are left out",
        ));
    }
    findings.extend(restarts(clock, common));
    let steps = statistics.steps(source);
    let fell = clock.restarts.iter().filter(|r| r.leap_ns < 0).count();
    let disordered = steps.backward.saturating_sub(fell);
    if disordered > 0 && source != StampSource::Log {
        let size = match steps.largest_backward.filter(|_| fell == 0) {
            Some(largest) => format!(
                ", at most by {:.4} s, at log time {} ns",
                largest.size_s(),
                largest.log_time_ns
            ),
            None => String::new(),
        };
        let seen = format!("{disordered} stamps are earlier than the one before{size}");
        let done = "samples are sorted by stamp; the causal estimator leaves out what comes late";
        findings.push(ClockFinding::handled(Kind::DisorderedStamps, seen, done));
    }
    if steps.duplicates as f64 > REPEATED_SHARE * messages as f64 && source != StampSource::Log {
        let seen = format!("{} stamps are that of the message before", steps.duplicates);
        let done = "of messages with one stamp the first is used";
        findings.push(ClockFinding::handled(Kind::RepeatedStamps, seen, done));
    }
    findings
}

fn restarts(clock: &OwnClock, common: &[CommonRestart]) -> Option<ClockFinding> {
    let first = clock.restarts.first()?;
    let way = |leap_ns: i64| if leap_ns < 0 { "back" } else { "ahead" };
    let seen = format!(
        "the clock leaps {} time(s), first {} by {:.3} s at log time {} ns: a restart, a clock that was set, or a replay in a loop",
        clock.restarts.len(),
        way(first.leap_ns),
        seconds_between(0, first.leap_ns).abs(),
        first.log_time_ns
    );
    let nearest = common
        .iter()
        .min_by_key(|c| c.log_time_ns.abs_diff(first.log_time_ns));
    let done = match nearest.is_some_and(|common| common.is_whole) {
        true => {
            "all topics do so: the runs are put one after the other by the log time, a second apart, and nothing is carried over"
        }
        false => "other topics go on: the parts are joined by the log time",
    };
    Some(ClockFinding::handled(Kind::ClockRestart, seen, done))
}

/// The log time is all there is.
pub(super) fn only_log_times(clock: &StampDecision) -> ClockFinding {
    let seen = format!("log time is used: {}", clock.reason);
    let done = "no signal has a better one; how long messages were on their way is an error of their times";
    ClockFinding::reported(Kind::NoHeaderStamp, seen, done)
}

/// How a topic's clock is apart from that of the log.
pub(super) fn seen_apart(
    anchor: &str,
    is_other: bool,
    apart_ns: i64,
    drift: Option<&Line>,
) -> String {
    let apart_s = seconds_between(0, apart_ns);
    let way = if apart_s < 0.0 { "behind" } else { "ahead of" };
    let drift = drift.map(|line| {
        format!(
            "its clock gains {:.1} ppm on that of {anchor} (standard deviation {:.1}), {:.0} ms over the log",
            line.slope * 1e6,
            line.slope_sigma * 1e6,
            line.slope * line.span_s * 1e3
        )
    });
    let apart = is_other.then(|| {
        let apart = format!("its clock is {:.3} s {way} that of {anchor}", apart_s.abs());
        match apart_s.abs() > OTHER_EPOCH_S {
            true => format!("{apart}, of another epoch"),
            false => apart,
        }
    });
    let parts: Vec<String> = apart.into_iter().chain(drift).collect();
    parts.join("; ")
}

/// What is odd about the clock of a log.
pub(super) fn of_base(
    source: StampSource,
    map: &LogMap,
    topics: &[&Times],
    clock_topic: Option<&str>,
) -> Vec<ClockFinding> {
    let mut middles: Vec<i64> = (topics.iter())
        .filter_map(|times| times.log_ns().get(times.len() / 2).copied())
        .collect();
    let Some(log_ns) = median_ns(&mut middles) else {
        return Vec::new();
    };
    if source != StampSource::Header {
        return Vec::new();
    }
    let offset_ns = map.at(log_ns);
    let stamp_ns = log_ns.saturating_add(offset_ns);
    let line = &map.line;
    let pace = 1.0 + line.slope;
    let is_known = line.span_s > LEAST_SPAN_S && line.slope.abs() > 5.0 * line.slope_sigma;
    let at_pace = match is_known && line.slope.abs() > OTHER_PACE {
        true => format!("; they pass at {pace:.3} of the pace of the log times"),
        false => String::new(),
    };
    let used = "the stamps are the time of all signals and of the rows, log times tell only the order of arrival";
    let from_start = (0..EARLIEST_DATE_NS).contains(&stamp_ns);
    if from_start || clock_topic.is_some() {
        let topic = clock_topic.map_or(String::new(), |name| format!(" (topic {name})"));
        let what = match (from_start, clock_topic) {
            (true, Some(_)) => format!("stamps are times of a simulation{topic}"),
            (true, None) => {
                "stamps count from the start of something, of a simulation or the machine"
                    .to_owned()
            }
            (false, _) => {
                format!("a simulation tells its time{topic}, yet stamps are dates")
            }
        };
        let log_is = match is_date(log_ns) {
            true => "log times are dates",
            false => "log times count from a start as well",
        };
        let seen = format!("{what}, {log_is}{at_pace}");
        return vec![ClockFinding::handled(Kind::SimulationTime, seen, used)];
    }
    let offset_s = seconds_between(0, offset_ns);
    let apart = if !is_date(log_ns) {
        Some("log times are no dates, stamps are: the log was rewritten".to_owned())
    } else if offset_s.abs() > OTHER_EPOCH_S {
        let way = if offset_s < 0.0 { "later" } else { "earlier" };
        let days = offset_s.abs() / 86_400.0;
        Some(format!(
            "log times are {days:.2} days {way} than stamps: recorded from a replay, or with a wrong clock"
        ))
    } else if !at_pace.is_empty() {
        Some("recorded from a replay at another pace".to_owned())
    } else {
        None
    };
    let replayed = |what: String| {
        let seen = format!("{what}{at_pace}");
        ClockFinding::handled(Kind::ReplayedLog, seen, used)
    };
    apart.map(replayed).into_iter().collect()
}
