//! Constrained minimisation of the cost over the box: sequential quadratic programming with bounded work.
//!
//! Each iteration computes the exact optimum of the quadratic model ([`quadratic_step`]) and halves the step
//! until cost plus constraint violation decreases sufficiently. The cost's part of the Hessian, S(11), is exact;
//! the curvature of loads and angles, which is small because they are nearly linear, is estimated from the change
//! of their exact gradients between iterates (structured secant update of Dennis, Gay and Welsch), so
//! convergence is nearly quadratic. If the linearised margins are infeasible, the smallest margin is maximised
//! instead. Every iterate is inside the box.

use super::quadratic_step::{Step, dot, quadratic_step};
use super::raise_margin::raising_step;
use crate::cost::Evaluation;

/// Maximum number of evaluations of a problem.
pub(crate) const MAX_EVALUATIONS: usize = 40;
/// Maximum number of iterations.
pub(crate) const MAX_ITERATIONS: usize = 12;
/// Maximum number of halvings of a step.
const MAX_HALVINGS: usize = 6;
/// Convergence: the predicted next step is below this fraction of half the range.
const NEXT_STEP: f64 = 1e-10;
/// Constraint tolerance of a margin.
const MARGIN_TOLERANCE: f64 = 1e-9;
/// Smallest increase of the smallest margin that justifies another step.
const WORTH_RAISING: f64 = 1e-6;
/// Fraction of the predicted decrease required by the Armijo condition.
const SUFFICIENT: f64 = 1e-4;
/// Relative rounding error of a cost.
const COST_ROUNDING: f64 = 1e-14;
/// Steps below this fraction of half the range may fail to decrease the cost because of rounding alone.
const ROUNDING_STEP: f64 = 1e-6;

/// Error of a quadratic model across the box, as a fraction of the cost.
const FLAT_SHARE: f64 = 1e-2;
/// Maximum number of points tried across the box: corners and sides for two variables.
const MAX_ACROSS: usize = 8;

/// Outcome of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ending {
    /// The optimum was found.
    Converged,
    /// The best feasible point found within the work limit.
    WorkLimit,
    /// No feasible point: the point with the largest smallest margin found.
    NoMargin,
    /// The problem is not finite at a point.
    NotFinite,
}

/// Result of a search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Minimum<const N: usize> {
    pub(crate) z: [f64; N],
    pub(crate) ending: Ending,
    pub(crate) cost: f64,
    pub(crate) iterations: usize,
    pub(crate) evaluations: usize,
}

/// A search: the problem, and the evaluations so far.
struct Search<F, const N: usize> {
    evaluate: F,
    evaluations: usize,
    iterations: usize,
    /// The feasible point of least cost.
    cheapest: Option<([f64; N], f64)>,
    /// The point with the largest smallest margin.
    safest: ([f64; N], f64, f64),
}

/// Minimises from `start`, in the box from -1 to 1.
pub(crate) fn minimise<const N: usize>(
    start: [f64; N],
    evaluate: impl FnMut(&[f64; N]) -> Evaluation<N>,
) -> Minimum<N> {
    let start = start.map(|z| z.clamp(-1.0, 1.0));
    let mut search = Search {
        evaluate,
        evaluations: 0,
        iterations: 0,
        cheapest: None,
        safest: (start, f64::NEG_INFINITY, f64::NAN),
    };
    let Some(mut here) = search.evaluate_at(&start) else {
        return search.end(start, Ending::NotFinite);
    };
    let mut z = start;
    let (mut raised, mut first_bottom) = (false, None);
    loop {
        match search.descend(z, here) {
            Descent::Done(bottom) => {
                // With negative curvature, another side of the box may have a lower minimum.
                if first_bottom.is_none() && bottom.curves_down {
                    first_bottom = Some(bottom);
                    if let Some(there) = search.across_box(&bottom) {
                        (z, here) = there;
                        continue;
                    }
                }
                let lowest = first_bottom.filter(|first| first.cost < bottom.cost);
                let lowest = lowest.unwrap_or(bottom);
                return search.ended(lowest.z, Ending::Converged, lowest.cost);
            }
            Descent::Stuck => return search.best_found(),
            Descent::NoMargin(at, evaluation) if !raised => {
                raised = true;
                (z, here) = search.raise(at, evaluation);
                if here.least_margin() < -MARGIN_TOLERANCE {
                    return search.best_found();
                }
            }
            Descent::NoMargin(..) => return search.best_found(),
        }
    }
}

/// End of a descent.
#[derive(Debug, Clone, Copy)]
struct Bottom<const N: usize> {
    z: [f64; N],
    cost: f64,
    gradient: [f64; N],
    hessian: [[f64; N]; N],
    /// Whether the quadratic model has negative curvature.
    curves_down: bool,
}

/// Outcome of a descent.
enum Descent<const N: usize> {
    Done(Bottom<N>),
    Stuck,
    /// The linearised margins are infeasible from here.
    NoMargin([f64; N], Evaluation<N>),
}

impl<F: FnMut(&[f64; N]) -> Evaluation<N>, const N: usize> Search<F, N> {
    /// Evaluates the problem at a point; `None` if it is not finite there or the work limit is reached.
    fn evaluate_at(&mut self, z: &[f64; N]) -> Option<Evaluation<N>> {
        if self.evaluations == MAX_EVALUATIONS {
            return None;
        }
        self.evaluations += 1;
        let found = (self.evaluate)(z);
        if !found.is_finite() {
            return None;
        }
        let (margin, cost) = (found.least_margin(), found.cost);
        let cheaper = self.cheapest.is_none_or(|(_, least)| cost < least);
        if margin >= -MARGIN_TOLERANCE && cheaper {
            self.cheapest = Some((*z, cost));
        }
        if margin > self.safest.1 {
            self.safest = (*z, margin, cost);
        }
        Some(found)
    }

    /// The best point across the box if its cost is lower than that of `bottom`. Tries the points at which the
    /// quadratic model is lower or only slightly higher.
    fn across_box(&mut self, bottom: &Bottom<N>) -> Option<([f64; N], Evaluation<N>)> {
        let mut cheapest: Option<([f64; N], Evaluation<N>)> = None;
        // With two variables, the points with a slightly higher model value would be too many.
        let (candidates, lower) = match N {
            1 => (2, FLAT_SHARE * bottom.cost.abs()),
            _ => (MAX_ACROSS, 0.0),
        };
        for there in across(&bottom.z).into_iter().take(candidates) {
            let d: [f64; N] = std::array::from_fn(|i| there[i] - bottom.z[i]);
            let turned: [f64; N] = std::array::from_fn(|i| dot(&bottom.hessian[i], &d));
            let model = dot(&bottom.gradient, &d) + 0.5 * dot(&turned, &d);
            if !(model < lower) {
                continue;
            }
            let least = cheapest.as_ref().map_or(bottom.cost, |(_, at)| at.cost);
            let found = self
                .evaluate_at(&there)
                .filter(|at| at.least_margin() >= -MARGIN_TOLERANCE && at.cost < least);
            cheapest = found.map(|at| (there, at)).or(cheapest);
        }
        cheapest
    }

    fn descend(&mut self, mut z: [f64; N], mut here: Evaluation<N>) -> Descent<N> {
        let mut penalty: f64 = 0.0;
        let mut secant = [[0.0; N]; N];
        // Ratio of a step's size to that of the preceding step.
        let mut before = 1.0;
        while self.iterations < MAX_ITERATIONS {
            let hessian = sum(&here.curvature, &secant);
            let Some(Step { d, multipliers }) = quadratic_step(&z, &here, &hessian) else {
                return Descent::NoMargin(z, here);
            };
            let size = d.iter().fold(0.0, |size: f64, d| size.max(d.abs()));
            if size * (size / before).min(1.0) <= NEXT_STEP {
                return Descent::Done(bottom(moved(&z, &d, 1.0), &here, &hessian));
            }
            self.iterations += 1;
            let largest = multipliers.iter().fold(0.0, |a: f64, &b| a.max(b));
            penalty = penalty.max(2.0 * largest);
            if here.least_margin() < -MARGIN_TOLERANCE {
                penalty = penalty.max(here.cost.abs() + 1.0);
            }
            let Some((there, next, share)) = self.line(&z, &here, &d, penalty) else {
                // No further decrease: rounding, if the step is small.
                return if size <= ROUNDING_STEP {
                    Descent::Done(bottom(z, &here, &hessian))
                } else {
                    Descent::Stuck
                };
            };
            let step: [f64; N] = std::array::from_fn(|i| there[i] - z[i]);
            secant_update(
                &mut secant,
                &step,
                &next.unknown_curvature(&here, &multipliers),
            );
            (z, here, before) = (there, next, size * share);
        }
        Descent::Stuck
    }

    /// Line search: the first halving of the step that decreases cost plus violation sufficiently.
    fn line(
        &mut self,
        z: &[f64; N],
        here: &Evaluation<N>,
        d: &[f64; N],
        penalty: f64,
    ) -> Option<([f64; N], Evaluation<N>, f64)> {
        let merit = |at: &Evaluation<N>| at.cost + penalty * violation(at);
        let before = merit(here);
        let slope = (dot(&here.gradient, d) - penalty * violation(here)).min(0.0);
        let rounding = COST_ROUNDING * before.abs();
        let mut share = 1.0;
        for _ in 0..=MAX_HALVINGS {
            let there = moved(z, d, share);
            let enough = before + SUFFICIENT * share * slope + rounding;
            if let Some(at) = self.evaluate_at(&there).filter(|at| merit(at) <= enough) {
                return Some((there, at, share));
            }
            share *= 0.5;
        }
        None
    }

    /// Maximises the smallest margin.
    fn raise(&mut self, mut z: [f64; N], mut here: Evaluation<N>) -> ([f64; N], Evaluation<N>) {
        let mut share: f64 = 1.0;
        while self.iterations < MAX_ITERATIONS {
            let (d, promised) = raising_step(&z, &here);
            if promised < here.least_margin() + WORTH_RAISING {
                break;
            }
            self.iterations += 1;
            // If the last step had to be shortened, this one may have to be as well.
            share = (2.0 * share).min(1.0);
            let mut found = None;
            for _ in 0..=MAX_HALVINGS {
                let there = moved(&z, &d, share);
                let worth = here.least_margin() + WORTH_RAISING;
                if let Some(at) = self
                    .evaluate_at(&there)
                    .filter(|at| at.least_margin() > worth)
                {
                    found = Some((there, at));
                    break;
                }
                share *= 0.5;
            }
            let Some(next) = found else { break };
            (z, here) = next;
        }
        (z, here)
    }

    /// The best point found.
    fn best_found(&self) -> Minimum<N> {
        match self.cheapest {
            Some((z, cost)) => self.ended(z, Ending::WorkLimit, cost),
            None => self.ended(self.safest.0, Ending::NoMargin, self.safest.2),
        }
    }

    fn end(&self, z: [f64; N], ending: Ending) -> Minimum<N> {
        let cost = self.cheapest.map_or(f64::NAN, |(_, cost)| cost);
        self.ended(z, ending, cost)
    }

    fn ended(&self, z: [f64; N], ending: Ending, cost: f64) -> Minimum<N> {
        Minimum {
            z,
            ending,
            cost,
            iterations: self.iterations,
            evaluations: self.evaluations,
        }
    }
}

/// Powell's symmetric update: the smallest symmetric change of a matrix that makes it map `step` to `unknown_curvature`.
fn secant_update<const N: usize>(
    secant: &mut [[f64; N]; N],
    step: &[f64; N],
    unknown_curvature: &[f64; N],
) {
    let square = dot(step, step);
    if !(square > 0.0) {
        return;
    }
    let miss: [f64; N] = std::array::from_fn(|i| unknown_curvature[i] - dot(&secant[i], step));
    let along = dot(&miss, step) / square;
    for i in 0..N {
        for j in 0..N {
            let both = miss[i] * step[j] + step[i] * miss[j] - along * step[i] * step[j];
            secant[i][j] += both / square;
        }
    }
}

fn sum<const N: usize>(a: &[[f64; N]; N], b: &[[f64; N]; N]) -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j]))
}

/// The end of a descent at `z`.
fn bottom<const N: usize>(z: [f64; N], here: &Evaluation<N>, hessian: &[[f64; N]; N]) -> Bottom<N> {
    let crossed = N > 1 && hessian[0][0] * hessian[N - 1][N - 1] < hessian[0][N - 1].powi(2);
    Bottom {
        z,
        cost: here.cost,
        gradient: here.gradient,
        hessian: *hessian,
        curves_down: crossed || (0..N).any(|i| hessian[i][i] < 0.0),
    }
}

/// The corners of the box, and the points of its sides across from `z`.
fn across<const N: usize>(z: &[f64; N]) -> [[f64; N]; MAX_ACROSS] {
    let end = |bit: usize| if bit == 0 { -1.0 } else { 1.0 };
    std::array::from_fn(|k| match k.checked_sub(1 << N) {
        None => std::array::from_fn(|i| end(k >> i & 1)),
        Some(side) => {
            let mut there = *z;
            there[side / 2 % N] = end(side & 1);
            there
        }
    })
}

/// Total constraint violation.
fn violation<const N: usize>(at: &Evaluation<N>) -> f64 {
    at.margins()
        .iter()
        .map(|margin| (-margin.value).max(0.0))
        .sum()
}

/// z + share d, clamped to the box.
fn moved<const N: usize>(z: &[f64; N], d: &[f64; N], share: f64) -> [f64; N] {
    std::array::from_fn(|i| (z[i] + d[i] * share).clamp(-1.0, 1.0))
}
