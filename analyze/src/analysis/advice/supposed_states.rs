//! The states of a log under hypotheses.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use tipwatch_mechanics::State;
use tipwatch_mechanics::machine::Machine;

use super::hypothesis::{Hypothesis, Supposed};
use super::to_base::ToBase;
use crate::base::state_source::{EstimatedStates, StateSource};

/// States whose sensor is at the base frame, changed by hypotheses in their order. Measured forces of actuators are unknown.
pub(crate) struct SupposedStates {
    recorded: Arc<dyn StateSource>,
    /// The machine that was recorded.
    recorded_by: Machine,
    /// The same with its sensor at the base frame.
    machine: Machine,
    hypotheses: Vec<Hypothesis>,
    /// Of the rows (ns), and which of the recorded states is that of the first.
    times_ns: Vec<i64>,
    first: usize,
}

impl fmt::Debug for SupposedStates {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("SupposedStates")
            .field("hypotheses", &self.hypotheses)
            .finish_non_exhaustive()
    }
}

impl SupposedStates {
    pub(crate) fn new(
        recorded: Arc<dyn StateSource>,
        recorded_by: Machine,
        hypotheses: Vec<Hypothesis>,
        (times_ns, first): (Vec<i64>, usize),
    ) -> Self {
        Self {
            recorded,
            machine: recorded_by.measured_at_base(),
            recorded_by,
            hypotheses,
            times_ns,
            first,
        }
    }

    /// Time of a recorded state (ns); of one beside the rows, which is read with them, that of the nearest row.
    fn time_ns(&self, state: usize) -> i64 {
        let last = self.times_ns.len().saturating_sub(1);
        let row = state.saturating_sub(self.first).min(last);
        self.times_ns.get(row).copied().unwrap_or(0)
    }

    /// Calls `change` with each row and its state.
    fn changed(&self, mut each: impl FnMut(&mut dyn FnMut(usize, &mut State<f64>))) {
        let mut to_base = ToBase::new(&self.recorded_by);
        let mut supposed = Supposed::new(&self.machine);
        each(&mut |row, state| {
            to_base.apply(&self.recorded_by, state);
            for hypothesis in &self.hypotheses {
                supposed.apply(hypothesis, self.time_ns(row), state);
            }
            state.actuator_force.fill(f64::NAN);
        });
    }
}

impl StateSource for SupposedStates {
    fn rows_at_once(&self) -> usize {
        self.recorded.rows_at_once()
    }

    fn read(&self, rows: Range<usize>) -> EstimatedStates {
        let mut found = self.recorded.read(rows.clone());
        let mut state = State::zero(&self.machine);
        self.changed(|change| {
            for (place, row) in rows.clone().enumerate() {
                found.states.get(place, &mut state);
                change(row, &mut state);
                found.states.set(place, &mut state);
            }
        });
        found
    }

    fn state(&self, row: usize, state: &mut State<f64>) {
        self.recorded.state(row, state);
        self.changed(|change| change(row, state));
    }

    fn failure(&self) -> Option<String> {
        self.recorded.failure()
    }
}
