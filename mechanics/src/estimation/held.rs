//! The last known value of a filter, held at rest.

use crate::estimation::history::History;
use crate::estimation::reading::{FilterStatus, Reading};
use crate::estimation::white_jerk::Channel;

/// Whether samples around a time are close enough to show motion: the samples on both sides of the time, or, if the time is that
/// of a sample, the samples up to it. `before` is the index of the last sample up to the time.
pub(in crate::estimation) fn is_dense(
    stamps_ns: &[i64],
    before: usize,
    time_ns: i64,
    max_gap_ns: i64,
) -> bool {
    let is_near = |a: usize, b: usize| {
        let both = stamps_ns.get(a).zip(stamps_ns.get(b));
        both.is_some_and(|(a, b)| b.saturating_sub(*a) <= max_gap_ns)
    };
    is_near(before, before + 1)
        || (stamps_ns.get(before) == Some(&time_ns) && before > 0 && is_near(before - 1, before))
}

/// Holds the last sample up to a time, if it is not older than `hold_ns`: its value, and at its own stamp its
/// measured velocity; no acceleration. What that leaves unknown is in
/// [`UnobservedMotion`](super::quasi_static::UnobservedMotion), not in the covariance.
pub(in crate::estimation) fn held(
    history: &History,
    before: usize,
    time_ns: i64,
    hold_ns: i64,
    channels: &mut [Channel],
) -> Reading {
    let age_ns = time_ns.saturating_sub(history.stamps_ns()[before]);
    if age_ns > hold_ns {
        return Reading::NOTHING;
    }
    for (channel, &[value, rate, _]) in channels.iter_mut().zip(history.jets(before)) {
        let rate = if age_ns == 0 { rate } else { 0.0 };
        channel.jet = [value, rate, 0.0];
    }
    let mut covariance = [[0.0; 3]; 3];
    covariance[0][0] = history.covariance(before)[0][0];
    Reading {
        standing: FilterStatus::Known,
        covariance,
    }
}
