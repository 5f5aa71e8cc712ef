//! Row times, and the estimate of one row.

use crate::estimation::support_configuration::{GroundGap, GroundSet};
use crate::machine::SessionProofs;
use crate::state::{Reasons, State};

/// When rows are emitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RowClock {
    /// At every sample of the first stream of joint states.
    JointStates,
    /// At a regular rate (Hz), starting at the first sample of that stream.
    Rate(f64),
}

/// Estimate of the state at one row time.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// Row time (ns), in the clock of the stamps.
    pub time_ns: i64,
    /// The state; NaN throughout where a gap leaves it unknown.
    pub state: State<f64>,
    /// Why the row is invalid, as far as the signals show.
    pub reasons: Reasons,
    /// Whether the platform falls, by gyro and attitude alone.
    pub rotates: bool,
    /// What the signals up to this row have shown.
    pub shown: SessionProofs,
    /// The supports on the ground, or why they are unknown; `None` for a machine that is always on the same ones.
    pub stands_on: Option<Result<GroundSet, GroundGap>>,
    /// What each of [`Machine::load_sensors`](crate::machine::Machine::load_sensors) measured last (N); NaN where that is too old, or
    /// where it is not among the sensors.
    pub measured_loads: Vec<f64>,
    /// The rate that is asked of each of [`Machine::joints`](crate::machine::Machine::joints) (rad/s or m/s); NaN where none is, or where
    /// the last one is too old.
    pub commands: Vec<f64>,
    /// The force of the actuator that lifts each of [`Machine::payloads`](crate::machine::Machine::payloads) (N), where its mass is
    /// estimated by it; NaN where it is too old.
    pub lift_forces: Vec<f64>,
}

/// Stamp of a regular clock: the k-th after `start_ns`, without accumulated rounding.
pub(super) fn regular_stamp(start_ns: i64, k: u64, rate_hz: f64) -> i64 {
    // The difference of two i64 stamps may exceed i64.
    let stamp = i128::from(start_ns) + (k as f64 * 1e9 / rate_hz).round() as i128;
    i64::try_from(stamp).unwrap_or(i64::MAX)
}

/// The k-th stamp of the regular clock, unless it is later than `until_ns` or not representable.
pub(super) fn regular_row(start_ns: i64, k: u64, rate_hz: f64, until_ns: i64) -> Option<i64> {
    let stamp = regular_stamp(start_ns, k, rate_hz);
    (stamp <= until_ns && stamp < i64::MAX).then_some(stamp)
}

/// Index of a stamp of the regular clock that is at most, and close to, `stamp_ns`.
pub(super) fn regular_index(start_ns: i64, stamp_ns: i64, rate_hz: f64) -> u64 {
    // A negative time, before the first row, saturates at zero.
    let elapsed_s = (i128::from(stamp_ns) - i128::from(start_ns)) as f64 * 1e-9;
    (elapsed_s * rate_hz - 1.0).floor() as u64
}

impl Estimate {
    pub(super) fn unknown(machine: &crate::machine::Machine) -> Self {
        Self {
            time_ns: 0,
            state: State::zero(machine),
            reasons: Reasons::NONE,
            rotates: false,
            shown: SessionProofs::NONE,
            stands_on: None,
            commands: vec![f64::NAN; machine.joints().len()],
            lift_forces: vec![f64::NAN; machine.payloads().len()],
            measured_loads: vec![f64::NAN; machine.load_sensors().len()],
        }
    }
}
