//! When rows are, and what a row of states holds.

use crate::state::{Reasons, State};

/// When rows are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RowClock {
    /// At every sample of the first stream of joint states.
    JointStates,
    /// At this regular rate (Hz), from the first sample of that stream on.
    Rate(f64),
}

/// The state at the time of a row.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// Time of the row (ns), in the stamps' clock.
    pub time_ns: i64,
    /// The state; NaN throughout where a gap leaves it unknown.
    pub state: State<f64>,
    /// Why the row is not valid, so far as the signals tell.
    pub reasons: Reasons,
}

/// Stamps of a regular clock: the k-th after `start_ns`, without drift.
pub(super) fn regular_stamp(start_ns: i64, k: u64, rate_hz: f64) -> i64 {
    // two stamps may be further apart than a stamp is from zero
    let stamp = i128::from(start_ns) + (k as f64 * 1e9 / rate_hz).round() as i128;
    i64::try_from(stamp).unwrap_or(i64::MAX)
}

/// The k-th stamp of the regular clock, if it is not after `until_ns` nor beyond what can be counted.
pub(super) fn regular_row(start_ns: i64, k: u64, rate_hz: f64, until_ns: i64) -> Option<i64> {
    let stamp = regular_stamp(start_ns, k, rate_hz);
    (stamp <= until_ns && stamp < i64::MAX).then_some(stamp)
}

/// A stamp of the regular clock that is not after `stamp_ns` and near it, by its number.
pub(super) fn regular_index(start_ns: i64, stamp_ns: i64, rate_hz: f64) -> u64 {
    // a negative time is before the first
    let elapsed_s = (i128::from(stamp_ns) - i128::from(start_ns)) as f64 * 1e-9;
    (elapsed_s * rate_hz - 1.0).floor() as u64
}

impl Estimate {
    pub(super) fn unknown(machine: &crate::machine::Machine) -> Self {
        Self {
            time_ns: 0,
            state: State::zero(machine),
            reasons: Reasons::NONE,
        }
    }
}
