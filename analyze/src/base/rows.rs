//! The results of a log, row by row.

use nalgebra::Vector3;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::signal::Reasons;
use tipwatch_mechanics::verdict::{Conditions, Verdict};
use tipwatch_mechanics::{OutcomeColumns, State, StateColumns};

/// Results row by row.
#[derive(Debug)]
pub struct Rows {
    /// Times (ns), in the stamps' clock.
    pub times_ns: Vec<i64>,
    /// Why each row is not valid.
    pub reasons: Vec<Reasons>,
    /// The states.
    pub states: StateColumns,
    /// Wheel loads and stability; NaN where they cannot be computed.
    pub outcomes: OutcomeColumns,
    /// What a monitor says of each row; `None` of a model without uncertainty, which a verdict needs.
    pub verdicts: Option<Verdicts>,
}

impl Rows {
    /// How many rows there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.times_ns.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.times_ns.is_empty()
    }

    /// The direction up of a row in base axes, where the log knows it.
    #[must_use]
    pub fn up_in_base(&self, machine: &Machine, row: usize) -> Option<Vector3<f64>> {
        let mut state = State::zero(machine);
        self.states.get(row, &mut state);
        Some(state.base.up).filter(|up| up.iter().all(|c| c.is_finite()))
    }

    /// Whether a row's loads are known as well as they can be.
    #[must_use]
    pub fn is_valid(&self, row: usize) -> bool {
        self.reasons[row].is_empty()
    }

    /// The row at a time, or the first after it.
    #[must_use]
    pub fn at(&self, time_ns: i64) -> usize {
        let row = self.times_ns.partition_point(|&t| t < time_ns);
        row.min(self.len().saturating_sub(1))
    }

    /// Seconds of a row from the first one.
    #[must_use]
    pub fn seconds(&self, row: usize) -> f64 {
        (self.times_ns[row] - self.times_ns[0]) as f64 * 1e-9
    }
}

/// Verdicts row by row.
#[derive(Debug, Clone)]
pub struct Verdicts {
    /// The levels.
    pub verdicts: Vec<Verdict>,
    /// Time until a wheel lifts if its load falls on as it does now (s); NaN where none does within five
    /// seconds, or nothing is known.
    pub time_to_lift_off_s: Vec<f64>,
    /// What the monitor that recorded the log found wrong with its input at each row; empty of a log
    /// without a monitor.
    pub recorded: Vec<Conditions>,
}
