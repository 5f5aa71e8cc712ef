//! Describes clock anomalies in words.

use tipwatch_language::{say, word};

use super::{
    anchor::LogMap,
    finding::{ClockFinding, ClockFindingKind as Kind},
    line::{Line, median_ns},
    log_jumps::LogJump,
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
/// Most jumps whose times are listed.
const MOST_LISTED: usize = 10;

/// Anomalies of a topic's own clock.
pub(super) fn of_topic(
    statistics: &TopicStatistics,
    clock: &OwnClock<'_>,
    step_shifts: &[(usize, i64)],
    common: &[CommonRestart],
) -> Vec<ClockFinding> {
    let mut findings = Vec::new();
    let (messages, zero) = (statistics.message_count(), statistics.zero_stamps());
    let source = clock.decision.source;
    if source == StampSource::Header && zero > 0 {
        let seen = say!("{zero} of {messages} messages have a missing or zero stamp");
        findings.push(ClockFinding::handled(
            Kind::ZeroStamps,
            seen,
            word!("these messages are omitted"),
        ));
    }
    findings.extend(restarts(clock, common));
    findings.extend(stamp_steps(clock, step_shifts));
    let strays = clock.strays.indices.len();
    if strays > 0 {
        let seen = say!(
            "{strays} of {messages} stamps are ahead of those before and after them, by at most {:.3} s",
            seconds_between(0, clock.strays.farthest_ns)
        );
        let done = word!("these messages are omitted");
        findings.push(ClockFinding::handled(Kind::StrayStamps, seen, done));
    }
    let steps = statistics.steps(source);
    let fell = clock.restarts.iter().filter(|r| r.leap_ns < 0).count();
    let of_steps = clock.steps.iter().filter(|step| step.size_ns < 0).count();
    // each row of strays ends with a step back
    let disordered = steps.backward.saturating_sub(fell + of_steps + strays);
    if disordered > 0 && source != StampSource::Log {
        let is_largest = fell + of_steps + strays == 0;
        let size = match steps.largest_backward.filter(|_| is_largest) {
            Some(largest) => say!(
                ", by at most {:.4} s, at log time {} ns",
                largest.size_s(),
                largest.log_time_ns
            ),
            None => String::new(),
        };
        let seen = say!("{disordered} stamps are earlier than the previous one{size}");
        let done = word!("samples are sorted by stamp; the causal estimator omits late ones");
        findings.push(ClockFinding::handled(Kind::DisorderedStamps, seen, done));
    }
    if steps.duplicates as f64 > REPEATED_SHARE * messages as f64 {
        let seen = say!(
            "{} stamps repeat that of the previous message",
            steps.duplicates
        );
        let done = word!("the first message with each stamp is used");
        findings.push(ClockFinding::handled(Kind::RepeatedStamps, seen, done));
    }
    findings
}

fn restarts(clock: &OwnClock<'_>, common: &[CommonRestart]) -> Option<ClockFinding> {
    let first = clock.restarts.first()?;
    let jumps = clock.restarts.iter().map(|restart| {
        say!(
            "{} at log time {} ns",
            jump(restart.from_ns, restart.to_ns),
            restart.log_time_ns
        )
    });
    let seen = say!(
        "the clock jumps {} time(s): {}: a restart, a clock adjustment, or a looped replay",
        clock.restarts.len(),
        listed(jumps)
    );
    let nearest = common
        .iter()
        .min_by_key(|c| c.log_time_ns.abs_diff(first.log_time_ns));
    let done = match nearest.filter(|common| common.is_whole) {
        Some(_) => {
            let whole = common.iter().filter(|common| common.is_whole);
            let pauses_ns: i64 = whole.map(|common| common.pause_ns).sum();
            let later = match pauses_ns {
                0 => String::new(),
                _ => say!(
                    "; {:.3} s in all were added between runs that are closer than a second by the log time, so that \
                     times in the results are later than those of the log by so much at the end",
                    seconds_between(0, pauses_ns)
                ),
            };
            say!(
                "all topics restart: the runs are placed one after the other by the log time, at least one second \
                 apart, and no state is carried over{later}"
            )
        }
        None => word!("other topics continue: the parts are joined by the log time").to_owned(),
    };
    Some(ClockFinding::handled(Kind::ClockRestart, seen, done))
}

/// The clock of a topic was corrected.
fn stamp_steps(clock: &OwnClock<'_>, shifts: &[(usize, i64)]) -> Option<ClockFinding> {
    if clock.steps.is_empty() {
        return None;
    }
    let steps = clock.steps.iter().map(|step| {
        say!(
            "{} at log time {} ns",
            jump(step.from_ns, step.to_ns),
            step.log_time_ns
        )
    });
    let seen = say!(
        "the stamps step {} time(s) while the messages keep coming: {}: the clock of the sensor was corrected",
        clock.steps.len(),
        listed(steps)
    );
    let added = shifts
        .iter()
        .filter(|(_, shift)| *shift != 0)
        .map(|(from, shift)| {
            let shift_s = seconds_between(0, *shift);
            match from {
                0 => say!("{shift_s:+.4} s from the first one on"),
                _ => say!("{shift_s:+.4} s from the {}th one on", from + 1),
            }
        });
    let done = say!(
        "the stamps are shifted by message, so that their offset to the log time is the same throughout: {}",
        listed(added)
    );
    Some(ClockFinding::handled(Kind::StampStep, seen, done))
}

/// The clock of the recorder jumped.
pub(super) fn log_jumps(jumps: &[LogJump], source: StampSource) -> Vec<ClockFinding> {
    let of_kind = |wraps: bool| jumps.iter().filter(move |jump| jump.wraps == wraps);
    let text = |it: &LogJump| jump(it.from_ns, it.to_ns);
    let mut findings = Vec::new();
    let mut find = |seen: String, done: String| {
        findings.push(ClockFinding::handled(Kind::LogTimeJump, seen, done));
    };
    let wraps = of_kind(true).count();
    if wraps > 0 {
        find(
            say!(
                "the log time wraps around {wraps} time(s), as a counter of 32 or 16 bits does: {}",
                listed(of_kind(true).map(text))
            ),
            word!("it is continued: the messages behind are that much later").to_owned(),
        );
    }
    let others = of_kind(false).count();
    if others > 0 {
        let shifts = of_kind(false).map(|it| {
            say!(
                "{:+.3} s behind {}",
                seconds_between(0, it.shift_ns),
                time_s(it.to_ns)
            )
        });
        let done = match source {
            StampSource::Log => say!(
                "the order of the file is kept: the stretches are placed one after the other, one second apart, and no \
                 state is carried over; besides that second each, times in the results differ from those of the log by \
                 {}",
                listed(shifts)
            ),
            _ => {
                word!("the order of the file is kept, and the stamps are the time of the messages")
                    .to_owned()
            }
        };
        // only stamps show a small jump forward, and they stand still with a replay
        let are_ahead = of_kind(false).all(|it| it.to_ns > it.from_ns);
        let cause = match are_ahead && source != StampSource::Log {
            true => word!("the clock of the recorder was set, or a replay or simulation paused"),
            false => word!("the clock of the recorder restarted or was set"),
        };
        find(
            say!(
                "the log time jumps {others} time(s): {}: {cause}",
                listed(of_kind(false).map(text))
            ),
            done,
        );
    }
    findings
}

/// A jump of a clock, with the times before and after it.
fn jump(from_ns: i64, to_ns: i64) -> String {
    let size_s = seconds_between(from_ns, to_ns).abs();
    let (from, to) = (time_s(from_ns), time_s(to_ns));
    match to_ns < from_ns {
        true => say!("back by {size_s:.3} s, from {from} to {to}"),
        false => say!("forward by {size_s:.3} s, from {from} to {to}"),
    }
}

/// Formats a time in seconds, exact to the millisecond also where it is a date.
fn time_s(ns: i64) -> String {
    let sign = if ns < 0 { "-" } else { "" };
    let ms = ns.unsigned_abs() / 1_000_000;
    format!("{sign}{}.{:03} s", ms / 1000, ms % 1000)
}

/// The first of some texts.
fn listed(texts: impl Iterator<Item = String>) -> String {
    let all: Vec<String> = texts.collect();
    let mut list = all
        .iter()
        .take(MOST_LISTED)
        .cloned()
        .collect::<Vec<_>>()
        .join("; ");
    if let Some(more) = all.len().checked_sub(MOST_LISTED).filter(|more| *more > 0) {
        list.push_str(&say!("; and {more} more"));
    }
    list
}

/// Only log times are available.
pub(super) fn only_log_times(clock: &StampDecision) -> ClockFinding {
    let seen = say!("log time is used: {}", clock.reason);
    let done = word!(
        "no signal has a better one; the transport delay of each message is an error of its time, and a clock that is set \
         forward looks like a hole in the data: what follows is dated late by it"
    );
    ClockFinding::reported(Kind::NoHeaderStamp, seen, done)
}

/// Describes the offset (with `is_other`) and the drift of a topic's clock against that of `anchor`, as part of a sentence.
pub(super) fn seen_apart(
    anchor: &str,
    is_other: bool,
    apart_ns: i64,
    drift: Option<&Line>,
) -> String {
    let apart_s = seconds_between(0, apart_ns);
    let drift = drift.map(|line| {
        say!(
            "its clock gains {:.1} ppm on that of {anchor} (standard deviation {:.1} ppm), {:.0} ms over the log",
            line.slope * 1e6,
            line.slope_sigma * 1e6,
            line.slope * line.span_s * 1e3
        )
    });
    let apart = is_other.then(|| {
        let size_s = apart_s.abs();
        let apart = match apart_s < 0.0 {
            true => say!("its clock is {size_s:.3} s behind that of {anchor}"),
            false => say!("its clock is {size_s:.3} s ahead of that of {anchor}"),
        };
        match size_s > OTHER_EPOCH_S {
            true => say!("{apart}, in another epoch"),
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
        true => say!("; they advance at {pace:.3} times the rate of the log times"),
        false => String::new(),
    };
    let used = word!(
        "the stamps are the time of all signals and rows; log times only determine the order of arrival"
    );
    let from_start = (0..EARLIEST_DATE_NS).contains(&stamp_ns);
    if from_start || clock_topic.is_some() {
        let topic = clock_topic.map_or(String::new(), |name| say!(" (topic {name})"));
        let what = match (from_start, clock_topic) {
            (true, Some(_)) => say!("stamps are simulation time{topic}"),
            (true, None) => {
                word!("stamps count from the start of a simulation or of the machine").to_owned()
            }
            (false, _) => {
                say!("a simulation publishes its time{topic}, but stamps are dates")
            }
        };
        let log_is = match is_date(log_ns) {
            true => word!("log times are dates"),
            false => word!("log times also count from a start"),
        };
        let seen = format!("{what}, {log_is}{at_pace}");
        return vec![ClockFinding::handled(Kind::SimulationTime, seen, used)];
    }
    let offset_s = seconds_between(0, offset_ns);
    let apart = if !is_date(log_ns) {
        Some(word!("log times are not dates, but stamps are: the log was rewritten").to_owned())
    } else if offset_s.abs() > OTHER_EPOCH_S {
        let way = match offset_s < 0.0 {
            true => word!("later"),
            false => word!("earlier"),
        };
        let days = offset_s.abs() / 86_400.0;
        Some(say!(
            "log times are {days:.2} days {way} than stamps: recorded from a replay, or with a wrong clock"
        ))
    } else if !at_pace.is_empty() {
        Some(word!("recorded from a replay at another rate").to_owned())
    } else {
        None
    };
    let replayed = |what: String| {
        let seen = format!("{what}{at_pace}");
        ClockFinding::handled(Kind::ReplayedLog, seen, used)
    };
    apart.map(replayed).into_iter().collect()
}
