//! Loads that balance themselves: how the ground can shift load between the wheels without a force or a moment.

use nalgebra::DMatrix;

use crate::evaluate::workspace::Workspace;

/// Singular values below this share of the largest count as zero.
const RANK: f64 = 1e-9;

/// Orthogonal unit vectors of loads by wheel that satisfy the equations of equilibrium with nothing on their right-hand
/// side, for the last evaluation of `workspace`. On uneven ground the split between them is unknown. None where
/// equilibrium determines all loads.
#[must_use]
pub fn self_equilibrated_loads(workspace: &Workspace<f64>) -> Vec<Vec<f64>> {
    let equations = &workspace.equations;
    let (rows, wheels) = (equations.certain, equations.wheels);
    // As many rows as columns at least: otherwise the decomposition leaves out the null space.
    let matrix = DMatrix::from_fn(rows.max(wheels), wheels, |row, wheel| match row < rows {
        true => equations.factor[row][wheel],
        false => 0.0,
    });
    if !matrix.iter().all(|value| value.is_finite()) {
        return Vec::new();
    }
    let decomposed = matrix.svd(false, true);
    let Some(directions) = decomposed.v_t else {
        return Vec::new();
    };
    let values = &decomposed.singular_values;
    let least = values.max() * RANK;
    (0..wheels)
        .filter(|&row| values[row] <= least)
        .map(|row| directions.row(row).iter().copied().collect())
        .collect()
}
