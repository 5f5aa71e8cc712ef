//! Derivatives of single rows, as far as the standard deviation of a sum of loads needs them.

use std::collections::BTreeSet;
use std::fmt;

use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{Scope, State, Workspace, combination_sigma, evaluate};

/// Derivatives of the OTF by the parameters, computed row by row on request. One row is often needed several times,
/// with other sums of loads.
pub(super) struct RowDerivatives {
    state: State<f64>,
    workspace: Workspace<f64>,
    /// The row that was evaluated last.
    row: Option<usize>,
    /// Rows that have none: the machine tips.
    without: BTreeSet<usize>,
}

impl fmt::Debug for RowDerivatives {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("RowDerivatives")
            .field("row", &self.row)
            .finish_non_exhaustive()
    }
}

impl RowDerivatives {
    pub(super) fn new(machine: &Machine) -> Self {
        Self {
            state: State::zero(machine),
            workspace: Workspace::with_scope(machine, Scope::LOADS_AND_DERIVATIVES),
            row: None,
            without: BTreeSet::new(),
        }
    }

    /// Standard deviation of a weighted sum of the OTF of a row (N), whose state `read` reads; `None` without derivatives.
    /// The machine is always the same.
    pub(super) fn sigma(
        &mut self,
        machine: &Machine,
        row: usize,
        factors: &[f64],
        read: impl FnOnce(&mut State<f64>),
    ) -> Option<f64> {
        if self.without.contains(&row) {
            return None;
        }
        if self.row != Some(row) {
            read(&mut self.state);
            evaluate(machine, &self.state, &mut self.workspace);
            self.row = Some(row);
        }
        let sigma = combination_sigma(machine, &self.state, &self.workspace, factors);
        if sigma.is_nan() && !self.is_known(factors.len()) {
            self.without.insert(row);
        }
        (sigma.is_finite() && sigma > 0.0).then_some(sigma)
    }

    /// Whether the derivatives of the last row are numbers for so many wheels.
    fn is_known(&self, wheels: usize) -> bool {
        let sensitivity = self.workspace.sensitivity();
        (0..wheels).all(|wheel| sensitivity.otf(wheel).iter().all(|by| by.is_finite()))
    }
}
