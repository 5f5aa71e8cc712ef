//! The results of a log, row by row.

use nalgebra::Vector3;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::verdict::{Conditions, Verdict};
use tipwatch_mechanics::{OutcomeColumns, State, StateColumns};

/// Results row by row.
#[derive(Debug)]
pub struct Rows {
    /// Times (ns) on the clock of the stamps.
    pub times_ns: Vec<i64>,
    /// Reasons why a row is not valid; empty for a valid row.
    pub reasons: Vec<Reasons>,
    /// The states.
    pub states: StateColumns,
    /// Wheel loads and stability; NaN if not computable.
    pub outcomes: OutcomeColumns,
    /// Verdict of each row; `None` for models without uncertainty, which a verdict needs.
    pub verdicts: Option<Verdicts>,
}

impl Rows {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.times_ns.len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.times_ns.is_empty()
    }

    /// Upward direction of a row in base axes, if the log has an attitude.
    #[must_use]
    pub fn up_in_base(&self, machine: &Machine, row: usize) -> Option<Vector3<f64>> {
        let mut state = State::zero(machine);
        self.states.get(row, &mut state);
        Some(state.base.up).filter(|up| up.iter().all(|c| c.is_finite()))
    }

    /// Whether a row is valid.
    #[must_use]
    pub fn is_valid(&self, row: usize) -> bool {
        self.reasons[row].is_empty()
    }

    /// The row at a time, or the next one.
    #[must_use]
    pub fn at(&self, time_ns: i64) -> usize {
        let row = self.times_ns.partition_point(|&t| t < time_ns);
        row.min(self.len().saturating_sub(1))
    }

    /// Time of a row (s) after the first one.
    #[must_use]
    pub fn seconds(&self, row: usize) -> f64 {
        (self.times_ns[row] - self.times_ns[0]) as f64 * 1e-9
    }
}

/// Verdicts of a monitor, row by row.
#[derive(Debug, Clone)]
pub struct Verdicts {
    /// Levels.
    pub verdicts: Vec<Verdict>,
    /// Time (s) until the first wheel lifts off if its load keeps falling at the current rate; NaN if
    /// more than five seconds, or unknown.
    pub time_to_lift_off_s: Vec<f64>,
    /// Input faults that the monitor recorded in the log for each row; empty for a log without a monitor.
    pub recorded: Vec<Conditions>,
}
