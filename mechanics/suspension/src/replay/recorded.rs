//! The recorded rows that a replay starts from.

use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::{Reasons, State, StateColumns};

use super::moved_state::Rods;

/// Recorded states, row by row.
#[derive(Debug, Clone, Copy)]
pub struct RecordedRows<'a> {
    /// Times (ns), ascending.
    pub times_ns: &'a [i64],
    /// Reasons why a row is not valid; empty for a valid row.
    pub reasons: &'a [Reasons],
    /// The states.
    pub states: &'a StateColumns,
}

impl RecordedRows<'_> {
    pub(super) fn len(&self) -> usize {
        self.times_ns.len()
    }

    /// Whether the loads of a row can be computed.
    pub(super) fn has_loads(&self, row: usize) -> bool {
        self.reasons[row].leave_loads()
    }

    /// Whether the loads of a row can be computed and the positions of its rods are known.
    pub(super) fn is_usable(&self, row: usize, rods: &Rods) -> bool {
        self.has_loads(row) && rods.iter().all(|rod| rod.position.is_finite())
    }

    /// Positions of the joints in the first row where loads can be computed and all positions are known.
    pub(super) fn first_posture(&self, machine: &Machine) -> Option<Vec<f64>> {
        let mut state = State::zero(machine);
        (0..self.len())
            .filter(|&row| self.has_loads(row))
            .find_map(|row| {
                self.states.get(row, &mut state);
                let positions = state.joints.iter().map(|joint| joint.position);
                let posture: Vec<f64> = positions.collect();
                posture.iter().all(|p| p.is_finite()).then_some(posture)
            })
    }
}
