//! Simulation of a change: the smallest margins over the rows of the window.

use std::cell::RefCell;

use rayon::prelude::*;
use tipwatch_mechanics::{BatchEvaluator, ForcesByRule, Lanes, OutcomeColumns, Quantity, State};

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

/// Evaluates the window as logged.
pub(super) fn as_logged(window: &Window) -> Margins {
    margins(window, &window.evaluator, None)
}

/// Evaluates the window with a change by an amount.
pub(super) fn simulate(window: &Window, change: Change, amount: f64) -> Margins {
    if let Some(machine) = change.changed_machine(amount, window.machine()) {
        return margins(window, &Window::evaluator(&machine), Some(&|_| {}));
    }
    let changed = |state: &mut State<Lanes>| change.apply(amount, window.entry_speed, state);
    margins(window, &window.evaluator, Some(&changed))
}

/// OTF of an evaluator's machine, by wheel and row (N).
pub(super) fn otf(window: &Window, evaluator: &BatchEvaluator) -> Vec<Vec<f64>> {
    let of_block = |outcomes: &OutcomeColumns, _| -> Vec<Vec<f64>> {
        let wheels = 0..window.machine().wheels().len();
        wheels
            .map(|wheel| outcomes.column(Quantity::Otf(wheel)).to_vec())
            .collect()
    };
    let blocks = blocks(window, evaluator, None, of_block);
    let joined = |mut all: Vec<Vec<f64>>, block: Vec<Vec<f64>>| {
        for (column, more) in all.iter_mut().zip(block) {
            column.extend(more);
        }
        all
    };
    blocks.into_iter().reduce(joined).unwrap_or_default()
}

/// The smallest weighted sum of the OTF over the window (N), and its place; `None` if it can be computed in no row, or not
/// in one of ten.
pub(super) fn least_sum(window: &Window, factors: &[f64]) -> Option<(f64, usize)> {
    let of_block = |outcomes: &OutcomeColumns, first: usize| {
        let columns: Vec<(&[f64], f64)> = factors
            .iter()
            .enumerate()
            .filter(|(_, factor)| **factor != 0.0)
            .map(|(wheel, &factor)| (outcomes.column(Quantity::Otf(wheel)), factor))
            .collect();
        let rows = columns.first().map_or(0, |(column, _)| column.len());
        let sum = |row: usize| -> f64 {
            let of_wheel = |(column, factor): &(&[f64], f64)| factor * column[row];
            columns.iter().map(of_wheel).sum()
        };
        let known = (0..rows).map(|row| (sum(row), first + row));
        let known: Vec<Placed> = known.filter(|(sum, _)| sum.is_finite()).collect();
        (known.len(), known.into_iter().fold(NONE, smaller))
    };
    let blocks = blocks(window, &window.evaluator, None, of_block).into_iter();
    let (known, least) = blocks.fold((0, NONE), |(count, least), (known, of_block)| {
        (count + known, smaller(least, of_block))
    });
    (known > 0 && 10 * known >= 9 * window.rows.len()).then_some(least)
}

/// The smallest margins of the window by an evaluator, after a change of its states or of its machine.
fn margins(
    window: &Window,
    evaluator: &BatchEvaluator,
    change: Option<&StateChange<'_>>,
) -> Margins {
    let of_block = |outcomes: &OutcomeColumns, first| Least::of_block(window, outcomes, first);
    let blocks = blocks(window, evaluator, change, of_block).into_iter();
    blocks.fold(Least::of_none(window), Least::and).margins()
}

/// Evaluates the window in parallel blocks, as logged or after a change of its states or of its machine. `look` sees the outcomes
/// of each, and the place of its first row.
fn blocks<R: Send>(
    window: &Window,
    evaluator: &BatchEvaluator,
    change: Option<&StateChange<'_>>,
    look: impl Fn(&OutcomeColumns, usize) -> R + Sync,
) -> Vec<R> {
    let rows = window.rows.len();
    let firsts: Vec<usize> = (0..rows).step_by(BLOCK_ROWS).collect();
    firsts
        .into_par_iter()
        .map(|first| {
            let block = first..(first + BLOCK_ROWS).min(rows);
            let look = |found: &OutcomeColumns| look(found, first);
            let Some(change) = change else {
                return evaluator.look_at(&window.states, block, &|_| {}, look);
            };
            let machines = [window.machine(), evaluator.machine()];
            let forces = RefCell::new(ForcesByRule::new(window.machine()));
            let changed = |state: &mut State<Lanes>| {
                forces.borrow_mut().change(machines, state, change);
            };
            evaluator.look_at(&window.states, block, &changed, look)
        })
        .collect()
}

/// Change of states.
type StateChange<'a> = dyn Fn(&mut State<Lanes>) + Sync + 'a;
/// A number and its place.
type Placed = (f64, usize);
/// Value where no number is known.
const NONE: Placed = (f64::INFINITY, 0);

/// The least margins of some rows.
struct Least {
    otf: Vec<Placed>,
    any_split: Vec<Placed>,
    zmp: Placed,
    /// Negative overturning moment, by edge.
    moments: Vec<Placed>,
    not_computable: Option<usize>,
}

impl Least {
    /// Returns the margins before any row.
    fn of_none(window: &Window) -> Self {
        let machine = window.machine();
        Self {
            otf: vec![NONE; machine.wheels().len()],
            any_split: vec![NONE; machine.wheels().len()],
            zmp: NONE,
            moments: vec![NONE; machine.polygon().edges().len()],
            not_computable: None,
        }
    }

    /// Returns the smallest margins of consecutive rows, of which the first one has the place `first`.
    fn of_block(window: &Window, outcomes: &OutcomeColumns, first: usize) -> Self {
        let wheels = 0..window.machine().wheels().len();
        let edges = 0..window.machine().polygon().edges().len();
        let least = |column: &mut dyn Iterator<Item = f64>| {
            let (value, row) = least(column);
            (value, first + row)
        };
        let otf = wheels.clone().map(|wheel| {
            let column = outcomes.column(Quantity::Otf(wheel));
            least(&mut column.iter().copied())
        });
        let any_split = wheels.map(|wheel| {
            let column = outcomes.column(Quantity::LoadLeast(wheel));
            least(&mut column.iter().copied())
        });
        let moments = edges.map(|edge| {
            let column = outcomes.column(Quantity::ItomFull(edge));
            least(&mut column.iter().map(|moment| -moment))
        });
        let otf_of_first = outcomes.column(Quantity::Otf(0));
        let zmp = outcomes.column(Quantity::ZmpMargin);
        let mut sums = otf_of_first.iter().zip(zmp).map(|(otf, zmp)| otf + zmp);
        Self {
            otf: otf.collect(),
            any_split: any_split.collect(),
            zmp: least(&mut zmp.iter().copied()),
            moments: moments.collect(),
            not_computable: sums.position(|sum| !sum.is_finite()).map(|row| first + row),
        }
    }

    /// Combines the margins with those of later rows.
    fn and(mut self, later: Self) -> Self {
        let otf = self.otf.iter_mut().zip(later.otf);
        let any_split = self.any_split.iter_mut().zip(later.any_split);
        let moments = self.moments.iter_mut().zip(later.moments);
        let pairs = otf.chain(any_split).chain(moments);
        for (so_far, later) in pairs.chain([(&mut self.zmp, later.zmp)]) {
            *so_far = smaller(*so_far, later);
        }
        self.not_computable = self.not_computable.or(later.not_computable);
        self
    }

    fn margins(self) -> Margins {
        let nearest = self.moments.into_iter().fold(NONE, smaller);
        Margins {
            otf: self.otf,
            any_split: self.any_split.into_iter().map(|(load, _)| load).collect(),
            zmp: self.zmp,
            moment: (-nearest.0, nearest.1),
            not_computable: self.not_computable,
        }
    }
}

/// The smaller one; of equal ones the earlier one.
fn smaller(earlier: Placed, later: Placed) -> Placed {
    match later.0 < earlier.0 {
        true => later,
        false => earlier,
    }
}

fn least(values: &mut dyn Iterator<Item = f64>) -> Placed {
    let placed = values.enumerate().map(|(row, value)| (value, row));
    placed.fold(NONE, smaller)
}
