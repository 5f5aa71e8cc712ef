//! Simulation of a change: the loads of every row of the window, and the smallest margins.

use std::ops::Range;

use rayon::prelude::*;
use tipwatch_mechanics::{BatchEvaluator, OutcomeColumns, Quantity, State, StateColumns};

use super::change::Change;
use super::window::Window;
use crate::base::table::BLOCK_ROWS;

/// Smallest margins over a window.
#[derive(Debug, Clone)]
pub(super) struct Margins {
    /// Smallest OTF by wheel (N), and its place in the window.
    pub(super) otf: Vec<(f64, usize)>,
    /// Smallest load by wheel under any split that equilibrium allows (N).
    pub(super) any_split: Vec<f64>,
    /// Smallest distance of the centre of pressure from the nearest edge (m), and its place.
    pub(super) zmp: (f64, usize),
    /// Largest overturning moment about any edge (N m), and its place.
    pub(super) moment: (f64, usize),
    /// The first row that cannot be computed.
    pub(super) not_computable: Option<usize>,
}

/// Evaluates the window, with a change by an amount or as logged.
pub(super) fn evaluated(window: &Window, change: Option<(Change, f64)>) -> OutcomeColumns {
    let (as_logged, machine) = (|rows| window.states.block(rows), window.machine());
    let Some((change, amount)) = change else {
        return evaluate_all(&window.evaluator, window.rows.len(), as_logged);
    };
    if let Some(machine) = change.changed_machine(amount, machine) {
        let evaluator = Window::evaluator(&machine);
        return evaluate_all(&evaluator, window.rows.len(), as_logged);
    }
    let changed = |rows: Range<usize>| {
        let mut states = window.states.block(rows);
        let mut state = State::zero(machine);
        for row in 0..states.rows() {
            states.get(row, &mut state);
            change.apply(amount, window.entry_speed, &mut state);
            states.set(row, &mut state);
        }
        states
    };
    evaluate_all(&window.evaluator, window.rows.len(), changed)
}

/// Evaluates all rows in parallel blocks, of which `states` gives the states.
fn evaluate_all(
    evaluator: &BatchEvaluator,
    rows: usize,
    states: impl Fn(Range<usize>) -> StateColumns + Sync,
) -> OutcomeColumns {
    let blocks: Vec<usize> = (0..rows).step_by(BLOCK_ROWS).collect();
    let evaluated: Vec<OutcomeColumns> = blocks
        .into_par_iter()
        .map(|first| {
            let states = states(first..(first + BLOCK_ROWS).min(rows));
            evaluator.evaluate(&states, 0..states.rows())
        })
        .collect();
    let mut all = OutcomeColumns::empty(evaluator.machine(), evaluator.scope());
    for block in evaluated {
        all.append(block);
    }
    all
}

/// OTF under the stated split, by wheel and row (N), without the part that measured actuator forces determine.
pub(super) fn otf_by_rule(window: &Window, outcomes: &OutcomeColumns) -> Vec<Vec<f64>> {
    let wheels = 0..window.machine().wheels().len();
    wheels
        .map(|wheel| outcomes.column(Quantity::Otf(wheel)).to_vec())
        .collect()
}

/// The smallest margins of an evaluated window.
pub(super) fn margins(window: &Window, outcomes: &OutcomeColumns) -> Margins {
    let wheels = 0..window.machine().wheels().len();
    let edges = 0..window.machine().polygon().edges().len();
    let otf = wheels.clone().map(|wheel| {
        let by_rule = outcomes.column(Quantity::Otf(wheel));
        let measured = window.measured_split.get(wheel);
        let otf = |row: usize| by_rule[row] + measured.map_or(0.0, |split| split[row]);
        least((0..window.rows.len()).map(otf))
    });
    let otf: Vec<(f64, usize)> = otf.collect();
    let any_split = wheels.map(|wheel| {
        let column = outcomes.column(Quantity::LoadLeast(wheel));
        least(column.iter().copied()).0
    });
    let moments = edges.map(|edge| {
        let column = outcomes.column(Quantity::ItomFull(edge));
        least(column.iter().map(|moment| -moment))
    });
    let nearest = moments.fold((f64::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a });
    let (first, zmp) = (
        outcomes.column(Quantity::Otf(0)),
        outcomes.column(Quantity::ZmpMargin),
    );
    Margins {
        any_split: any_split.collect(),
        zmp: least(zmp.iter().copied()),
        moment: (-nearest.0, nearest.1),
        not_computable: (0..first.len()).find(|&row| !(first[row] + zmp[row]).is_finite()),
        otf,
    }
}

/// Evaluates the window with a change.
pub(super) fn simulate(window: &Window, change: Change, amount: f64) -> Margins {
    margins(window, &evaluated(window, Some((change, amount))))
}

fn least(values: impl Iterator<Item = f64>) -> (f64, usize) {
    let smaller = |best: (f64, usize), (row, value): (usize, f64)| match value < best.0 {
        true => (value, row),
        false => best,
    };
    values.enumerate().fold((f64::INFINITY, 0), smaller)
}
