//! Row times, the estimate of one row, and the estimated states of several.

use std::ops::Range;

use crate::estimation::support_configuration::{GroundGap, GroundSet};
use crate::machine::{Machine, SessionProofs};
use crate::state::{Reasons, State, StateColumns};

/// Times at which rows are emitted.
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
    /// Reasons for which the row is invalid or doubted, as far as the signals show.
    pub reasons: Reasons,
    /// Whether the platform rotates about an edge of its supports or falls, by gyro and attitude alone.
    pub rotates: bool,
    /// Proofs and doubts about sensors by the samples up to this row.
    pub shown: SessionProofs,
    /// The supports on the ground, or why they are unknown; `None` for a machine that is always on the same ones.
    pub stands_on: Option<Result<GroundSet, GroundGap>>,
    /// The last measurement of each of [`Machine::load_sensors`] (N); NaN where it is too old, or where the sensor is missing.
    pub measured_loads: Vec<f64>,
    /// The rate that is asked of each of [`Machine::joints`] (rad/s or m/s); NaN where none is, or where the last one is too old.
    pub commands: Vec<f64>,
    /// The force of the actuator that lifts each of [`Machine::payloads`] (N), where its mass is estimated by it; NaN where it is too
    /// old.
    pub lift_forces: Vec<f64>,
    /// The last measurement of each of [`Machine::arm_forces`] (N); NaN where it is too old, or where a signal is missing.
    pub arm_forces: Vec<f64>,
}

/// Estimated states of consecutive rows.
#[derive(Debug, Clone)]
pub struct EstimatedStates {
    /// The states; NaN where a gap leaves them unknown.
    pub states: StateColumns,
    /// Reasons for which each row is invalid or doubted, as far as the signals show.
    pub reasons: Vec<Reasons>,
}

impl EstimatedStates {
    /// No rows.
    #[must_use]
    pub fn empty(machine: &Machine) -> Self {
        Self {
            states: StateColumns::unknown(machine, 0),
            reasons: Vec::new(),
        }
    }

    /// Some of the rows.
    #[must_use]
    pub fn part(&self, rows: Range<usize>) -> Self {
        Self {
            states: self.states.block(rows.clone()),
            reasons: self.reasons[rows].to_vec(),
        }
    }

    /// Appends the rows that follow.
    pub fn append(&mut self, next: &Self) {
        self.states.append(&next.states);
        self.reasons.extend_from_slice(&next.reasons);
    }
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
    pub(super) fn unknown(machine: &Machine) -> Self {
        Self {
            time_ns: 0,
            state: State::zero(machine),
            reasons: Reasons::NONE,
            rotates: false,
            shown: SessionProofs::NONE,
            stands_on: None,
            commands: vec![f64::NAN; machine.joints().len()],
            lift_forces: vec![f64::NAN; machine.payloads().len()],
            arm_forces: vec![f64::NAN; machine.arm_forces().len()],
            measured_loads: vec![f64::NAN; machine.load_sensors().len()],
        }
    }
}
