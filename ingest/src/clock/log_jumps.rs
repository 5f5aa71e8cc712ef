//! Jumps of the recorder's clock: a counter that starts anew or wraps around, a clock that is set.
//!
//! Every topic has the log time, and a log is written in the order of receipt. Where the log times of a topic step
//! back in the order of the file, and do not fill a hole, the clock of the recorder stepped. A step forward looks like a
//! pause; only stamps that go on as usual show it. The times behind are shifted so that the order of the file is that
//! of time.

use super::{
    stamp::StampSource,
    stamp_steps::{self, MOST_STEPS, Stamped},
    statistics::TopicStatistics,
    strays::Strays,
    time::NS_PER_S,
    times::Times,
};

/// A smaller step back is disorder (ns).
const LEAST_FALL_NS: i64 = 50_000_000;
/// Smallest step back that is a jump whether or not it fills a hole (ns).
const LARGE_FALL_NS: i64 = 10_000_000_000;
/// No recording pauses for longer: the clock was set (ns).
const LEAST_LEAP_NS: i64 = 30 * 86_400_000_000_000;
/// A smaller step forward against the stamps does not move them, and is jitter of the transport (ns).
const LEAST_AHEAD_NS: i64 = 50_000_000;
/// Smallest jump ahead in a log with one stamped topic (ns): a smaller one may be a longer way of its messages.
const LEAST_AHEAD_ALONE_NS: i64 = 1_000_000_000;
/// Messages that must confirm the new course.
const CONFIRMING: usize = 2;
/// Largest distance of a late block from its neighbours in time, in periods.
const MOST_PERIODS: i64 = 5;
/// Share of messages that fall behind the one before which no clock reaches: the file has no order.
const SHUFFLED_SHARE: f64 = 0.05;
/// Largest difference of the times at which two topics see the same jump (ns), besides some periods.
const TOGETHER_NS: i64 = 1_000_000_000;
/// A clock with more jumps is none.
const MOST_JUMPS: usize = 1000;
/// Periods of counters of 32 bits that count milliseconds, tenths of milliseconds and microseconds (ns).
const WRAPS_NS: [i64; 3] = [
    (1 << 32) * 1_000_000,
    (1 << 32) * 100_000,
    (1 << 32) * 1_000,
];
/// A counter of 16 bits, in milliseconds: short enough for a chance hit, so that its absolute value counts, too (ns).
const SHORT_WRAP_NS: i64 = (1 << 16) * 1_000_000;
/// Largest deviation of a wrap from the usual period (ns), besides some periods.
const WRAP_JITTER_NS: i64 = 20_000_000;

/// A jump of the recorder's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct LogJump {
    /// The log time of the last message before the jump.
    pub(super) from_ns: i64,
    /// The log time of the first message after the jump.
    pub(super) to_ns: i64,
    /// Shift of the log times from there on, besides that of earlier jumps.
    pub(super) shift_ns: i64,
    /// Whether the jump is a counter that wrapped around: then the time between is known.
    pub(super) wraps: bool,
}

/// A jump as one topic shows it.
#[derive(Debug, Clone, Copy)]
struct OwnJump {
    /// Index of the first message after the jump.
    index: usize,
    from_ns: i64,
    to_ns: i64,
}

/// Finds the jumps that the topics of a log have in common, in the order of the file.
pub(super) fn in_common(topics: &[(&str, &Times, &TopicStatistics)]) -> Vec<LogJump> {
    let jumps = by_log_times(topics);
    // two kinds at once are not told apart: their order in the file is that of different topics
    match jumps.is_empty() {
        true => by_stamps(topics),
        false => jumps,
    }
}

/// The jumps that the log times show by themselves.
fn by_log_times(topics: &[(&str, &Times, &TopicStatistics)]) -> Vec<LogJump> {
    if !topics.iter().any(|(_, _, statistics)| may_jump(statistics)) {
        return Vec::new();
    }
    let found: Vec<(Vec<OwnJump>, i64)> = (topics.iter())
        .map(|(_, times, statistics)| {
            let period_ns = period_ns(statistics);
            (find(times, period_ns), period_ns)
        })
        .collect();
    // the topic that shows most of them, and of such the fastest
    let all = found.iter().filter(|(jumps, _)| jumps.len() <= MOST_JUMPS);
    let Some((most, _)) = all.max_by_key(|(jumps, period_ns)| (jumps.len(), -period_ns)) else {
        return Vec::new();
    };
    let common = most.iter().map(|of_most| {
        let seen = found.iter().filter_map(|(jumps, period_ns)| {
            let own = jumps.iter().find(|own| is_same(own, of_most, *period_ns))?;
            Some((*own, *period_ns))
        });
        // the fastest topic is the one that tells best how much time passed
        let (own, period_ns) = seen
            .min_by_key(|(_, period)| *period)
            .unwrap_or((*of_most, 0));
        own.shifted(period_ns)
    });
    common.collect()
}

/// The steps forward that most stamped topics show: their log times step while their stamps go on as usual.
fn by_stamps(topics: &[(&str, &Times, &TopicStatistics)]) -> Vec<LogJump> {
    let is_stamped = |statistics: &TopicStatistics| statistics.header_minus_log_ns().is_some();
    let stamped = || topics.iter().filter(|(_, _, of)| is_stamped(of));
    let found: Vec<Vec<LogJump>> = stamped()
        .map(|(_, times, statistics)| steps_forward(times, statistics))
        .collect();
    let Some(first) = found.iter().max_by_key(|steps| steps.len()) else {
        return Vec::new();
    };
    let is_common = |jump: &&LogJump| {
        let is_it = |other: &LogJump| {
            let apart_ns = other.shift_ns.abs_diff(jump.shift_ns);
            other.to_ns.abs_diff(jump.to_ns) <= TOGETHER_NS.unsigned_abs()
                && apart_ns <= jump.shift_ns.unsigned_abs() / 4
        };
        let show = found.iter().filter(|steps| steps.iter().any(is_it)).count();
        let is_large = jump.shift_ns.unsigned_abs() >= LEAST_AHEAD_ALONE_NS.unsigned_abs();
        2 * show > found.len() && (show > 1 || is_large)
    };
    first.iter().filter(is_common).copied().collect()
}

fn steps_forward(times: &Times, statistics: &TopicStatistics) -> Vec<LogJump> {
    let spread_ns =
        (statistics.header_minus_log_ns()).map_or(0, |(least, most)| most.saturating_sub(least));
    if spread_ns < LEAST_AHEAD_NS {
        return Vec::new();
    }
    let (stamps, log_ns) = (times.by(StampSource::Header), times.log_ns());
    // seen from the stamps, it is the log time that steps
    let at = |index: usize| {
        Some(Stamped {
            log_ns: stamps.at(index)?,
            stamp_ns: log_ns[index],
        })
    };
    let steps = stamp_steps::find(stamps.len(), at, period_ns(statistics));
    if steps.len() > MOST_STEPS {
        return Vec::new();
    }
    let forward = steps.iter().filter(|step| step.size_ns >= LEAST_AHEAD_NS);
    let jump = |step: &stamp_steps::StampStep| LogJump {
        from_ns: step.from_ns,
        to_ns: step.to_ns,
        shift_ns: -step.size_ns,
        wraps: false,
    };
    forward.map(jump).collect()
}

/// Returns for each jump the index of the first message of a topic after it.
pub(super) fn places(times: &Times, statistics: &TopicStatistics, jumps: &[LogJump]) -> Vec<usize> {
    if jumps.is_empty() {
        return Vec::new();
    }
    let period_ns = period_ns(statistics);
    let own = find(times, period_ns);
    let mut own = own.iter().peekable();
    let mut from = 0;
    let mut places = Vec::with_capacity(jumps.len());
    for jump in jumps {
        let common = OwnJump {
            index: 0,
            from_ns: jump.from_ns,
            to_ns: jump.to_ns,
        };
        let place = match own.next_if(|own| is_same(own, &common, period_ns)) {
            Some(own) => own.index,
            None => {
                let end = own.peek().map_or(times.len(), |next| next.index);
                unseen(times.log_ns(), from..end, jump, period_ns)
            }
        };
        places.push(place);
        from = place;
    }
    places
}

/// Returns the shift from each of these messages on, for all jumps so far.
pub(super) fn shifts(places: &[usize], jumps: &[LogJump]) -> Vec<(usize, i64)> {
    let mut sum = 0_i64;
    let shift = |(&place, jump): (&usize, &LogJump)| {
        sum = sum.saturating_add(jump.shift_ns);
        (place, sum)
    };
    places.iter().zip(jumps).map(shift).collect()
}

/// Whether the statistics of the log times allow a jump: as a rule not, which spares a look at every message.
fn may_jump(statistics: &TopicStatistics) -> bool {
    let log = statistics.steps(StampSource::Log);
    let falls =
        |step: &super::steps::BackwardStep| step.size_s() * NS_PER_S >= LEAST_FALL_NS as f64;
    log.largest_backward.as_ref().is_some_and(falls) || log.leaps(LEAST_LEAP_NS)
}

fn period_ns(statistics: &TopicStatistics) -> i64 {
    let period_s = statistics.steps(StampSource::Log).period_s();
    period_s.map_or(0, |(period_s, _)| (period_s * NS_PER_S) as i64)
}

fn is_same(own: &OwnJump, other: &OwnJump, period_ns: i64) -> bool {
    let within = TOGETHER_NS
        .saturating_add(period_ns.saturating_mul(3))
        .unsigned_abs();
    own.from_ns.abs_diff(other.from_ns) <= within && own.to_ns.abs_diff(other.to_ns) <= within
}

/// The jumps of a topic's log times.
fn find(times: &Times, period_ns: i64) -> Vec<OwnJump> {
    let log_ns = times.log_ns();
    if is_one_series(log_ns, period_ns) {
        return Vec::new();
    }
    let strays = Strays::find(times.by(StampSource::Log), period_ns, i64::MAX);
    let mut jumps = Vec::new();
    let (mut run, mut highest, mut last) = (0, None::<i64>, 0);
    for (index, &time) in log_ns.iter().enumerate() {
        if strays.contains(index) {
            continue;
        }
        let single_step = time.saturating_sub(std::mem::replace(&mut last, time));
        let Some(before) = highest else {
            highest = Some(time);
            continue;
        };
        let step = time.saturating_sub(before);
        let falls = step <= -LEAST_FALL_NS && single_step <= -LEAST_FALL_NS;
        if !falls && step <= LEAST_LEAP_NS {
            highest = Some(before.max(time));
            continue;
        }
        let most_ns = (period_ns.saturating_mul(5) / 2).max(step.saturating_abs() / 2);
        let follows = |(k, _): &(usize, &i64)| {
            let last = log_ns[index + k];
            (-LEAST_FALL_NS..=most_ns).contains(&log_ns[index + k + 1].saturating_sub(last))
        };
        let next = log_ns[index + 1..].iter().take(CONFIRMING).enumerate();
        let is_confirmed = next.clone().filter(follows).count() == CONFIRMING;
        let is_small = falls && step > -LARGE_FALL_NS;
        if is_confirmed && !(is_small && fills_a_hole(log_ns, run, index, before, period_ns)) {
            jumps.push(OwnJump {
                index,
                from_ns: before,
                to_ns: time,
            });
            (run, highest) = (index, Some(time));
        }
    }
    jumps
}

/// Whether the messages are one recording without a hole once they are sorted: the file has its blocks or its rows in
/// another order. A clock that is set leaves a hole, or times that come twice.
fn is_one_series(log_ns: &[i64], period_ns: i64) -> bool {
    let mut sorted = log_ns.to_vec();
    sorted.sort_unstable();
    let step = |pair: &[i64]| pair[1].saturating_sub(pair[0]);
    let mut steps: Vec<i64> = sorted.windows(2).map(step).collect();
    steps.sort_unstable();
    let (Some(&least), Some(&most)) = (steps.first(), steps.last()) else {
        return false;
    };
    let usual = steps[steps.len() / 2];
    // two recordings of one time, shifted by half a period, are regular, too
    let falls = log_ns
        .windows(2)
        .filter(|pair| step(pair) <= -LEAST_FALL_NS);
    let is_shuffled = falls.count() as f64 >= SHUFFLED_SHARE * log_ns.len() as f64;
    let has_rate = is_shuffled || usual.saturating_mul(4) >= period_ns.saturating_mul(3);
    let is_regular = least.saturating_mul(2) >= usual && most <= usual.saturating_mul(MOST_PERIODS);
    least > 0 && is_regular && has_rate
}

/// Whether the messages from `index` on, up to the highest time before it, are a block that was written late: at times
/// between those before them, or right before the first of them. Then the log goes on behind the highest.
fn fills_a_hole(log_ns: &[i64], run: usize, index: usize, highest: i64, period_ns: i64) -> bool {
    let near_ns = period_ns.saturating_mul(3) / 2;
    let mut before: Vec<i64> = log_ns[run..index].to_vec();
    before.sort_unstable();
    let lowest = before.first().copied().unwrap_or(highest);
    let is_near = |time: i64| {
        let next = before.partition_point(|before| *before < time);
        let near = |k: usize| {
            (before.get(k)).is_some_and(|it| it.abs_diff(time) <= near_ns.unsigned_abs())
        };
        near(next) || next.checked_sub(1).is_some_and(near)
    };
    let behind = &log_ns[index..];
    let count = (behind.iter().position(|time| *time > highest)).unwrap_or(behind.len());
    let (block, rest) = behind.split_at(count);
    let among: Vec<i64> = (block.iter().copied())
        .filter(|time| *time >= lowest)
        .collect();
    if among.len() > CONFIRMING {
        return 2 * among.iter().filter(|time| is_near(**time)).count() <= among.len();
    }
    let (Some(&end), Some(&next)) = (block.iter().max(), rest.first()) else {
        return false;
    };
    let follows = |step: i64| step <= period_ns.saturating_mul(MOST_PERIODS);
    follows(lowest.saturating_sub(end)) && follows(next.saturating_sub(highest))
}

impl OwnJump {
    fn shifted(self, period_ns: i64) -> LogJump {
        let Self { from_ns, to_ns, .. } = self;
        let most_ns = WRAP_JITTER_NS
            .max(period_ns.saturating_mul(2))
            .unsigned_abs();
        let next_ns = from_ns.saturating_add(period_ns);
        let is_wrap = |wrap: i64| to_ns.saturating_add(wrap).abs_diff(next_ns) <= most_ns;
        let ends_at = |wrap: i64| from_ns < wrap && to_ns.unsigned_abs() <= most_ns;
        let wrap = WRAPS_NS.into_iter().find(|&wrap| is_wrap(wrap));
        let short = Some(SHORT_WRAP_NS).filter(|&wrap| is_wrap(wrap) && ends_at(wrap));
        let wrap = wrap.or(short);
        LogJump {
            from_ns,
            to_ns,
            shift_ns: wrap.unwrap_or_else(|| next_ns.saturating_sub(to_ns)),
            wraps: wrap.is_some(),
        }
    }
}

/// Finds the message before which a topic whose times show no jump must be divided: such that fewest messages are on the wrong
/// side, and the step there is closest to the usual one.
fn unseen(log_ns: &[i64], within: std::ops::Range<usize>, jump: &LogJump, period_ns: i64) -> usize {
    let is_late = |time: &&i64| **time > jump.from_ns.saturating_add(period_ns);
    let is_early = |time: &&i64| **time < jump.to_ns.saturating_sub(period_ns);
    let of_range = &log_ns[within.clone()];
    let mut wrong = of_range.iter().filter(is_early).count();
    let deviation = |place: usize| {
        let (Some(before), Some(after)) = (place.checked_sub(1), log_ns.get(place)) else {
            return period_ns.unsigned_abs();
        };
        let after = after.saturating_add(jump.shift_ns);
        after.saturating_sub(log_ns[before]).abs_diff(period_ns)
    };
    let mut best = (wrong, deviation(within.start), within.start);
    for (place, time) in within.clone().zip(of_range) {
        wrong += usize::from(is_late(&time));
        wrong -= usize::from(is_early(&time));
        best = best.min((wrong, deviation(place + 1), place + 1));
    }
    best.2
}
