//! Finds single times that are ahead of those around them.
//!
//! Such a time is not that of a restart: the messages behind it continue the course before it. Taken as it is, it
//! would look like a gap and then like a clock that steps back.

use super::times::Stamps;

/// A smaller step ahead is a gap or jitter (ns).
const LEAST_AHEAD_NS: i64 = 100_000_000;
/// Smallest step of a stray, in periods of the topic.
const LEAST_PERIODS: i64 = 3;
/// More in a row are a course of their own.
const MOST_IN_ROW: usize = 5;
/// Messages of which one must confirm that the course before goes on.
const CONFIRMING: usize = 2;
/// Share of single times ahead, one in so many, beyond which the clock cannot be used.
pub(super) const MOST_SHARE: usize = 10;

/// Single times ahead of their course.
#[derive(Debug, Clone, Default)]
pub(super) struct Strays {
    /// The messages, by index, rising.
    pub(super) indices: Vec<usize>,
    /// Largest lead of a stray over the course (ns).
    pub(super) farthest_ns: i64,
}

impl Strays {
    /// Finds those that are ahead by at most `most_ns` in the times of a topic whose messages usually come with this
    /// period (ns).
    pub(super) fn find(stamps: Stamps<'_>, period_ns: i64, most_ns: i64) -> Self {
        let least_ns = LEAST_AHEAD_NS.max(period_ns.saturating_mul(LEAST_PERIODS));
        let mut strays = Self::default();
        // messages ahead of the course, which may go on there or return
        let mut ahead: Vec<(usize, i64)> = Vec::with_capacity(MOST_IN_ROW);
        let mut course: Option<i64> = None;
        for (index, stamp) in stamps.iter().enumerate() {
            let Some(stamp) = stamp else {
                continue;
            };
            let Some(last) = course else {
                course = Some(stamp);
                continue;
            };
            let Some(least_ahead) = ahead.iter().map(|(_, stamp)| *stamp).min() else {
                match stamp.saturating_sub(last) > least_ns {
                    true => ahead.push((index, stamp)),
                    false => course = Some(stamp),
                }
                continue;
            };
            let half_ns = least_ahead.saturating_sub(last) / 2;
            let returns = |time: i64| (0..=half_ns).contains(&time.saturating_sub(last));
            let mut next = stamps.from(index + 1).iter().flatten().take(CONFIRMING);
            let mut is_last = true;
            let is_confirmed = next.any(|time| {
                is_last = false;
                returns(time) && time >= stamp
            });
            if returns(stamp) && (is_confirmed || is_last) {
                for (index, stamp) in ahead.drain(..) {
                    let ahead_ns = stamp.saturating_sub(last);
                    if ahead_ns <= most_ns {
                        strays.indices.push(index);
                        strays.farthest_ns = strays.farthest_ns.max(ahead_ns);
                    }
                }
                course = Some(stamp);
            } else if ahead.len() < MOST_IN_ROW {
                ahead.push((index, stamp));
            } else {
                ahead.clear();
                course = Some(stamp);
            }
        }
        strays
    }

    pub(super) fn contains(&self, index: usize) -> bool {
        self.indices.binary_search(&index).is_ok()
    }

    /// Whether so many times are strays that the clock cannot be used.
    pub(super) fn are_many(&self, messages: usize) -> bool {
        self.indices.len() * MOST_SHARE > messages
    }
}

#[cfg(test)]
mod tests {
    use super::super::times::Times;
    use super::*;

    const MS: i64 = 1_000_000;

    fn found(stamps_ms: impl Iterator<Item = i64>) -> Vec<usize> {
        let mut times = Times::default();
        for stamp in stamps_ms {
            times.push(None, stamp * MS, stamp * MS);
        }
        let stamps = times.by(crate::clock::StampSource::Log);
        Strays::find(stamps, 10 * MS, i64::MAX).indices
    }

    #[test]
    fn times_ahead_of_both_neighbours_are_strays_and_a_step_is_not() {
        let course = |i: i64| 1000 + 10 * i;
        let ahead = |i: i64| match i {
            20 | 50 | 51 => course(i) + 4000 - 10 * i,
            _ => course(i),
        };
        assert_eq!(found((0..100).map(ahead)), [20, 50, 51]);
        let step = |i: i64| course(i) + if i < 50 { 0 } else { 4000 };
        assert!(found((0..100).map(step)).is_empty());
        let back = |i: i64| course(i) - if i < 50 { 0 } else { 400 };
        assert!(found((0..100).map(back)).is_empty());
        // a pause, and a message that comes late
        let late = |i: i64| match i {
            60 => course(49) + 10,
            50.. => course(i) + 4000,
            _ => course(i),
        };
        assert!(found((0..100).map(late)).is_empty());
    }
}
