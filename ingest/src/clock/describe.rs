//! Describes clock anomalies in words.

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

/// Clocks that differ by more have different epochs (s).
const OTHER_EPOCH_S: f64 = 3600.0;
/// A larger rate difference means a replay or a simulation.
const OTHER_PACE: f64 = 0.01;
/// Shorter spans do not determine the rate (s).
const LEAST_SPAN_S: f64 = 1.0;
/// A smaller share of repeated stamps is not reported.
const REPEATED_SHARE: f64 = 0.01;

/// Anomalies of a topic's own clock.
pub(super) fn of_topic(
    statistics: &TopicStatistics,
    clock: &OwnClock,
    common: &[CommonRestart],
) -> Vec<ClockFinding> {
    let mut findings = Vec::new();
    let (messages, zero) = (statistics.message_count(), statistics.zero_stamps());
    let source = clock.decision.source;
    if source == StampSource::Header && zero > 0 {
        let seen = format!("{zero} of {messages} messages have a missing or zero stamp");
        findings.push(ClockFinding::handled(
            Kind::ZeroStamps,
            seen,
            "these messages are omitted",
        ));
    }
    findings.extend(restarts(clock, common));
    let steps = statistics.steps(source);
    let fell = clock.restarts.iter().filter(|r| r.leap_ns < 0).count();
    let disordered = steps.backward.saturating_sub(fell);
    if disordered > 0 && source != StampSource::Log {
        let size = match steps.largest_backward.filter(|_| fell == 0) {
            Some(largest) => format!(
                ", by at most {:.4} s, at log time {} ns",
                largest.size_s(),
                largest.log_time_ns
            ),
            None => String::new(),
        };
        let seen = format!("{disordered} stamps are earlier than the previous one{size}");
        let done = "samples are sorted by stamp; the causal estimator omits late ones";
        findings.push(ClockFinding::handled(Kind::DisorderedStamps, seen, done));
    }
    if steps.duplicates as f64 > REPEATED_SHARE * messages as f64 && source != StampSource::Log {
        let seen = format!(
            "{} stamps repeat that of the previous message",
            steps.duplicates
        );
        let done = "the first message with each stamp is used";
        findings.push(ClockFinding::handled(Kind::RepeatedStamps, seen, done));
    }
    findings
}

fn restarts(clock: &OwnClock, common: &[CommonRestart]) -> Option<ClockFinding> {
    let first = clock.restarts.first()?;
    let way = |leap_ns: i64| if leap_ns < 0 { "back" } else { "forward" };
    let seen = format!(
        "the clock jumps {} time(s), first {} by {:.3} s at log time {} ns: a restart, a clock adjustment, or a looped replay",
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
            "all topics restart: the runs are placed one after the other by the log time, one second apart, and no state is carried over"
        }
        false => "other topics continue: the parts are joined by the log time",
    };
    Some(ClockFinding::handled(Kind::ClockRestart, seen, done))
}

/// Only log times are available.
pub(super) fn only_log_times(clock: &StampDecision) -> ClockFinding {
    let seen = format!("log time is used: {}", clock.reason);
    let done =
        "no signal has a better one; the transport delay of each message is an error of its time";
    ClockFinding::reported(Kind::NoHeaderStamp, seen, done)
}

/// How a topic's clock differs from that of the log.
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
            "its clock gains {:.1} ppm on that of {anchor} (standard deviation {:.1} ppm), {:.0} ms over the log",
            line.slope * 1e6,
            line.slope_sigma * 1e6,
            line.slope * line.span_s * 1e3
        )
    });
    let apart = is_other.then(|| {
        let apart = format!("its clock is {:.3} s {way} that of {anchor}", apart_s.abs());
        match apart_s.abs() > OTHER_EPOCH_S {
            true => format!("{apart}, in another epoch"),
            false => apart,
        }
    });
    let parts: Vec<String> = apart.into_iter().chain(drift).collect();
    parts.join("; ")
}

/// Anomalies of the clock of a log.
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
        true => format!("; they advance at {pace:.3} times the rate of the log times"),
        false => String::new(),
    };
    let used = "the stamps are the time of all signals and rows; log times only determine the order of arrival";
    let from_start = (0..EARLIEST_DATE_NS).contains(&stamp_ns);
    if from_start || clock_topic.is_some() {
        let topic = clock_topic.map_or(String::new(), |name| format!(" (topic {name})"));
        let what = match (from_start, clock_topic) {
            (true, Some(_)) => format!("stamps are simulation time{topic}"),
            (true, None) => {
                "stamps count from the start of a simulation or of the machine".to_owned()
            }
            (false, _) => {
                format!("a simulation publishes its time{topic}, but stamps are dates")
            }
        };
        let log_is = match is_date(log_ns) {
            true => "log times are dates",
            false => "log times also count from a start",
        };
        let seen = format!("{what}, {log_is}{at_pace}");
        return vec![ClockFinding::handled(Kind::SimulationTime, seen, used)];
    }
    let offset_s = seconds_between(0, offset_ns);
    let apart = if !is_date(log_ns) {
        Some("log times are not dates, but stamps are: the log was rewritten".to_owned())
    } else if offset_s.abs() > OTHER_EPOCH_S {
        let way = if offset_s < 0.0 { "later" } else { "earlier" };
        let days = offset_s.abs() / 86_400.0;
        Some(format!(
            "log times are {days:.2} days {way} than stamps: recorded from a replay, or with a wrong clock"
        ))
    } else if !at_pace.is_empty() {
        Some("recorded from a replay at another rate".to_owned())
    } else {
        None
    };
    let replayed = |what: String| {
        let seen = format!("{what}{at_pace}");
        ClockFinding::handled(Kind::ReplayedLog, seen, used)
    };
    apart.map(replayed).into_iter().collect()
}
