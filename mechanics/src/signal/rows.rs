//! When rows are, and what a row of states holds.

use super::reason::Reasons;
use crate::state::State;

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
    start_ns.saturating_add((k as f64 * 1e9 / rate_hz).round() as i64)
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
