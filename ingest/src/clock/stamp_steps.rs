//! Finds where the stamps of one topic step although its messages keep coming as usual: its clock was corrected.
//!
//! Stamp minus log time scatters by the jitter of the transport, some milliseconds. A correction of the sensor's clock
//! shows in it as a step. It is one of the stamps, rather than of the log times, where the log times go on at the usual
//! period and the stamps do not.

use super::{
    line::{SIGMA_BY_MAD, median_ns},
    times::shift_at,
};

/// A smaller step is not corrected (ns).
const LEAST_STEP_NS: i64 = 20_000_000;
/// Messages on each side that determine the step, and how many are needed.
const WINDOW: usize = 50;
const LEAST_IN_WINDOW: usize = 10;
/// Ratio of a step to the scatter on both sides from which the step counts.
const SIGMAS: f64 = 8.0;
/// Most periods by which the log times advance in their usual way.
const MOST_PERIODS: i64 = 3;
/// A clock that is corrected more often is not known well enough.
pub(super) const MOST_STEPS: usize = 50;

/// A step of the stamps of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct StampStep {
    /// Index of the first message after the step.
    pub(super) index: usize,
    /// The stamps of the messages before and after the step.
    pub(super) from_ns: i64,
    pub(super) to_ns: i64,
    /// The log time of the message after the step.
    pub(super) log_time_ns: i64,
    /// Amount by which the stamps fall further behind the log time at the step (ns).
    pub(super) size_ns: i64,
}

/// A message with a stamp.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stamped {
    pub(super) log_ns: i64,
    pub(super) stamp_ns: i64,
}

impl Stamped {
    fn offset_ns(&self) -> i64 {
        self.stamp_ns.saturating_sub(self.log_ns)
    }
}

/// Finds the steps among this many messages of a topic that usually come with this period (ns). `at` gives a message by
/// its index, unless it has no usable stamp.
pub(super) fn find(
    messages: usize,
    at: impl Fn(usize) -> Option<Stamped>,
    period_ns: i64,
) -> Vec<StampStep> {
    let mut steps: Vec<StampStep> = Vec::new();
    let mut since = 0;
    let mut last: Option<Stamped> = None;
    for index in 0..messages {
        let Some(after) = at(index) else {
            continue;
        };
        let before = last.replace(after);
        let Some(before) = before.filter(|before| is_candidate(before, &after, period_ns)) else {
            continue;
        };
        let mut earlier: Vec<Stamped> = (since..index).rev().filter_map(&at).take(WINDOW).collect();
        earlier.reverse();
        let later: Vec<Stamped> = (index..messages).filter_map(&at).take(WINDOW).collect();
        if let Some(size_ns) = step_between(&earlier, &later) {
            steps.push(StampStep {
                index,
                from_ns: before.stamp_ns,
                to_ns: after.stamp_ns,
                log_time_ns: after.log_ns,
                size_ns,
            });
            since = index;
        }
    }
    steps
}

/// Whether the stamps step between two messages while the log times go on as usual.
fn is_candidate(before: &Stamped, after: &Stamped, period_ns: i64) -> bool {
    let jump_ns = after.offset_ns().saturating_sub(before.offset_ns());
    if jump_ns.saturating_abs() < LEAST_STEP_NS {
        return false;
    }
    let log_step = after.log_ns.saturating_sub(before.log_ns);
    let stamp_step = after.stamp_ns.saturating_sub(before.stamp_ns);
    let is_usual = (0..=period_ns.saturating_mul(MOST_PERIODS)).contains(&log_step);
    is_usual && 2 * stamp_step.abs_diff(period_ns) >= jump_ns.unsigned_abs()
}

/// The step of the offsets between two windows, where it stands out of their scatter.
fn step_between(earlier: &[Stamped], later: &[Stamped]) -> Option<i64> {
    let (before, scatter_before) = middle(earlier)?;
    let (after, scatter_after) = middle(later)?;
    let size_ns = after.saturating_sub(before);
    let least_ns = SIGMAS * SIGMA_BY_MAD * scatter_before.max(scatter_after) as f64;
    let stands_out = size_ns.saturating_abs() as f64 > least_ns;
    // also beyond the single messages beside it
    let jump_ns = later
        .first()?
        .offset_ns()
        .saturating_sub(earlier.last()?.offset_ns());
    let is_here = jump_ns.abs_diff(size_ns) < size_ns.unsigned_abs() / 2;
    (size_ns.saturating_abs() >= LEAST_STEP_NS && stands_out && is_here).then_some(size_ns)
}

/// Median of the offsets, and their median absolute deviation (ns).
fn middle(messages: &[Stamped]) -> Option<(i64, i64)> {
    if messages.len() < LEAST_IN_WINDOW {
        return None;
    }
    let mut offsets: Vec<i64> = messages.iter().map(Stamped::offset_ns).collect();
    let median = median_ns(&mut offsets)?;
    for offset in &mut offsets {
        *offset = offset.saturating_sub(median).saturating_abs();
    }
    Some((median, median_ns(&mut offsets)?))
}

/// The shifts from single messages on that undo the steps, given the course between two of them that is right: the
/// first where `right` is 0.
pub(super) fn shifts(steps: &[StampStep], right: usize) -> Vec<(usize, i64)> {
    let sum = |steps: &[StampStep]| {
        steps
            .iter()
            .map(|step| step.size_ns)
            .fold(0, i64::saturating_add)
    };
    let of_right = sum(&steps[..right]);
    let shift = |course: usize| of_right.saturating_sub(sum(&steps[..course]));
    let first = (0, shift(0));
    let later = steps
        .iter()
        .enumerate()
        .map(|(k, step)| (step.index, shift(k + 1)));
    std::iter::once(first).chain(later).collect()
}

/// Joins two lists of shifts, each from single messages on, into one.
pub(super) fn joined(a: &[(usize, i64)], b: &[(usize, i64)]) -> Vec<(usize, i64)> {
    if a.is_empty() || b.is_empty() {
        return [a, b].concat();
    }
    let mut starts: Vec<usize> = a.iter().chain(b).map(|(from, _)| *from).collect();
    starts.sort_unstable();
    starts.dedup();
    let sum = |from| (from, shift_at(a, from).saturating_add(shift_at(b, from)));
    starts.into_iter().map(sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn messages(offset_ms: impl Fn(i64) -> i64) -> Vec<Stamped> {
        let message = |i: i64| Stamped {
            log_ns: 10 * i * MS + (i * 7919) % MS,
            stamp_ns: (10 * i + offset_ms(i)) * MS,
        };
        (0..1000).map(message).collect()
    }

    fn found(messages: &[Stamped]) -> Vec<StampStep> {
        find(messages.len(), |index| Some(messages[index]), 10 * MS)
    }

    #[test]
    fn a_step_of_the_stamps_is_found_and_a_delay_is_not() {
        let steps = found(&messages(|i| if i < 400 { 0 } else { 300 }));
        assert_eq!(steps.len(), 1);
        assert_eq!(steps[0].index, 400);
        assert!((steps[0].size_ns - 300 * MS).abs() < MS);
        assert_eq!(shifts(&steps, 1)[0].1, steps[0].size_ns);
        // the stamps go on while the transport is delayed
        let mut delayed = messages(|_| 0);
        for message in &mut delayed[400..] {
            message.log_ns += 300 * MS;
        }
        assert_eq!(found(&delayed), []);
        // stamps of a coarse resolution
        assert_eq!(found(&messages(|i| -(10 * i % 100))), []);
    }

    #[test]
    fn shifts_of_two_kinds_add_up() {
        assert_eq!(
            joined(&[(3, 10)], &[(0, 1), (5, 2)]),
            [(0, 1), (3, 11), (5, 12)]
        );
        assert_eq!(joined(&[], &[(5, 2)]), [(5, 2)]);
    }
}
