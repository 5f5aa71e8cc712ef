//! Detects clocks that restart within a log: a restarted driver, or a looped replay.

use super::{
    line::{Line, median_ns},
    strays::Strays,
    times::Stamps,
};

/// A smaller step back is not a restart (ns), unless the log time steps back with it.
const LEAST_FALL_NS: i64 = 1_000_000_000;
/// Then a smaller one is disorder (ns).
const LEAST_COMMON_FALL_NS: i64 = 50_000_000;
/// Messages between the place where the stamps step back and that where the log time does.
const NEAR_LOG_JUMP: usize = 3;
/// A larger jump ahead of the log time means the clock was set (ns).
pub(super) const LEAST_LEAP_NS: i64 = 3_600_000_000_000;
/// Messages that must confirm the new clock.
const CONFIRMING: usize = 2;
/// Restarts of several topics within this log time are one event (ns).
pub(super) const TOGETHER_NS: i64 = 2_000_000_000;
/// Messages on each side that determine the shift.
const WINDOW: usize = 100;
/// A clock with more restarts is unusable.
pub(super) const MOST_RESTARTS: usize = 200;

/// A restart of a clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Restart {
    /// The first message of the new run.
    pub(super) index: usize,
    /// Log time of the restart (ns).
    pub(super) log_time_ns: i64,
    /// The stamps before and after the restart.
    pub(super) from_ns: i64,
    pub(super) to_ns: i64,
    /// The jump of the clock; negative if the clock stepped back.
    pub(super) leap_ns: i64,
    /// Shift of the new run that continues the clock along the log time.
    pub(super) shift_ns: i64,
}

/// A restart of one or several topics' clocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CommonRestart {
    pub(super) log_time_ns: i64,
    pub(super) shift_ns: i64,
    /// Whether every active topic restarted: then the runs are separate in time.
    pub(super) is_whole: bool,
    /// Time to add between the runs, so that no state is carried over: none if the log times are far enough apart.
    pub(super) pause_ns: i64,
}

/// Finds the restarts in a sequence of stamps, of which some are strays. `log_places` has the first message after each
/// jump of the recorder's clock, which `log_ns` has no more.
pub(super) fn find(
    stamps: Stamps<'_>,
    strays: &Strays,
    log_ns: &[i64],
    log_places: &[usize],
) -> Vec<Restart> {
    let is_common =
        |index: usize| (log_places.iter()).any(|place| place.abs_diff(index) <= NEAR_LOG_JUMP);
    let usable = |from: usize| {
        let all = stamps.from(from).iter().enumerate();
        let all = all.filter_map(move |(k, stamp)| Some((from + k, stamp?)));
        all.filter(|(index, _)| !strays.contains(*index))
    };
    let mut present = usable(0).peekable();
    let mut restarts = Vec::new();
    let Some(&(first, mut highest)) = present.peek() else {
        return restarts;
    };
    let mut log_of_highest = log_ns[first];
    for (index, stamp) in present {
        let leap_ns = stamp.saturating_sub(highest);
        // a block that the file has in another place steps back in both
        let against_log_ns = leap_ns.saturating_sub(log_ns[index].saturating_sub(log_of_highest));
        let is_set = against_log_ns > LEAST_LEAP_NS;
        let falls = leap_ns < -LEAST_FALL_NS && against_log_ns < -LEAST_FALL_NS;
        let falls_with_log = leap_ns <= -LEAST_COMMON_FALL_NS && is_common(index);
        if is_set || falls || falls_with_log {
            // after a single bad stamp, the clock returns to its previous course
            let follows =
                |(_, next): &(usize, i64)| next.abs_diff(stamp) < leap_ns.unsigned_abs() / 2;
            let next = usable(index + 1).take(CONFIRMING);
            // the log times have confirmed the common one
            if !falls_with_log && next.filter(follows).count() < CONFIRMING {
                continue;
            }
            restarts.push(Restart {
                index,
                log_time_ns: log_ns[index],
                from_ns: highest,
                to_ns: stamp,
                leap_ns,
                shift_ns: 0,
            });
            highest = stamp;
        }
        if stamp >= highest {
            (highest, log_of_highest) = (stamp, log_ns[index]);
        }
    }
    add_shifts(&mut restarts, stamps, strays, log_ns);
    restarts
}

fn add_shifts(restarts: &mut [Restart], stamps: Stamps<'_>, strays: &Strays, log_ns: &[i64]) {
    if restarts.is_empty() || restarts.len() > MOST_RESTARTS {
        return;
    }
    let bounds: Vec<usize> = std::iter::once(0)
        .chain(restarts.iter().map(|restart| restart.index))
        .chain(std::iter::once(stamps.len()))
        .collect();
    let offsets = |from: usize, to: usize| -> Vec<(i64, i64)> {
        (from..to)
            .filter(|i| !strays.contains(*i))
            .filter_map(|i| Some((log_ns[i], stamps.at(i)?.saturating_sub(log_ns[i]))))
            .collect()
    };
    let longest = bounds.windows(2).max_by_key(|run| run[1] - run[0]);
    let pace = longest.and_then(|run| Line::through(offsets(run[0], run[1]).into_iter()));
    let slope = pace.map_or(0.0, |line| line.slope);
    for (run, restart) in restarts.iter_mut().enumerate() {
        // offset of each message, extrapolated to the restart
        let at_restart = |(log, offset): (i64, i64)| {
            let ahead = restart.log_time_ns.saturating_sub(log) as f64;
            offset.saturating_add((slope * ahead) as i64)
        };
        let middle = |from: usize, to: usize| {
            let mut there: Vec<i64> = offsets(from, to).into_iter().map(at_restart).collect();
            median_ns(&mut there).unwrap_or(0)
        };
        let index = restart.index;
        let before = middle(bounds[run].max(index.saturating_sub(WINDOW)), index);
        let after = middle(index, bounds[run + 2].min(index + WINDOW));
        restart.shift_ns = before.saturating_sub(after);
    }
}

/// Returns for each restart the first message after it, and the sum of the topic's own shifts from there on (ns).
pub(super) fn own_shifts(restarts: &[Restart]) -> Vec<(usize, i64)> {
    shifts(restarts, &[])
}

/// Returns for each restart the first message after it, and the shift of the stamps from there on (ns): the sum over
/// all restarts so far, with common shifts where available.
pub(super) fn shifts(restarts: &[Restart], common: &[CommonRestart]) -> Vec<(usize, i64)> {
    let shift_of = |restart: &Restart| {
        let nearest = common
            .iter()
            .min_by_key(|c| c.log_time_ns.abs_diff(restart.log_time_ns));
        nearest
            .filter(|c| c.log_time_ns.abs_diff(restart.log_time_ns) <= TOGETHER_NS.unsigned_abs())
            .map_or(restart.shift_ns, |c| c.shift_ns)
    };
    let mut sum = 0_i64;
    let after = |restart: &Restart| {
        sum = sum.saturating_add(shift_of(restart));
        (restart.index, sum)
    };
    restarts.iter().map(after).collect()
}

/// Adds to each stamp the shift that applies from its message on.
pub(super) fn unrolled<'a>(
    stamps: Stamps<'a>,
    shifts: &'a [(usize, i64)],
) -> impl Iterator<Item = Option<i64>> + Clone + 'a {
    let mut shifts = shifts.iter().peekable();
    let mut shift = 0_i64;
    let add = move |(index, stamp): (usize, Option<i64>)| {
        while let Some((_, next)) = shifts.next_if(|(from, _)| *from <= index) {
            shift = *next;
        }
        stamp.map(|stamp| stamp.saturating_add(shift))
    };
    stamps.iter().enumerate().map(add)
}

/// A pause between two runs of a whole log, as a topic sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pause {
    log_time_ns: i64,
    /// The topic's own restart determines exactly which messages follow it, the log time only
    /// roughly.
    index: Option<usize>,
    /// Length of the pause (ns).
    pub(super) length_ns: i64,
}

impl Pause {
    /// The shortest time between two runs, so that no state is carried over (ns).
    pub(super) const LEAST_NS: i64 = 1_000_000_000;

    /// Returns one pause per restart of the whole log.
    pub(super) fn of(restarts: &[Restart], common: &[CommonRestart]) -> Vec<Self> {
        let whole = common.iter().filter(|restart| restart.is_whole);
        let pause = |whole: &CommonRestart| {
            let near = |r: &&Restart| {
                r.log_time_ns.abs_diff(whole.log_time_ns) <= TOGETHER_NS.unsigned_abs()
            };
            Self {
                log_time_ns: whole.log_time_ns,
                index: restarts.iter().find(near).map(|restart| restart.index),
                length_ns: whole.pause_ns,
            }
        };
        whole.map(pause).collect()
    }

    /// Returns a pause that begins at a message.
    pub(super) fn before(index: usize) -> Self {
        Self {
            log_time_ns: 0,
            index: Some(index),
            length_ns: Self::LEAST_NS,
        }
    }

    pub(super) fn is_before(self, index: usize, log_ns: i64) -> bool {
        match self.index {
            Some(own) => index >= own,
            None => log_ns >= self.log_time_ns,
        }
    }
}
