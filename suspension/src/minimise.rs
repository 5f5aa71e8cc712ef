//! The least cost over the box that leaves every margin: sequential quadratic programming of bounded
//! work.
//!
//! Each iteration takes the exact optimum of the quadratic model ([`quadratic_step`]) and halves it until
//! cost plus violation falls enough. Of the Hessian, the cost's own part S(11) is exact; the curvature of
//! loads and angles, a small part since they are nearly linear, is learnt from how their exact gradients
//! turn between iterates (the structured secant of Dennis, Gay and Welsch): the convergence is nearly
//! quadratic. Where the linearised margins cannot be met, the smallest margin is raised instead. Every
//! iterate lies in the box.

use crate::evaluation::Evaluation;
use crate::quadratic_step::{Step, dot, quadratic_step};
use crate::raise::raising_step;

/// Most evaluations of a problem, whatever it is.
pub(super) const MAX_EVALUATIONS: usize = 40;
/// Most iterations.
pub(super) const MAX_ITERATIONS: usize = 12;
/// Most halvings of a step.
const MAX_HALVINGS: usize = 6;
/// A step is the last where the next one would be below this share of half the range.
const NEXT_STEP: f64 = 1e-10;
/// A margin may be missed by this much.
const MARGIN_TOLERANCE: f64 = 1e-9;
/// Smallest rise of the smallest margin that is worth another step.
const WORTH_RAISING: f64 = 1e-6;
/// Armijo's share of the decrease that the slope promises.
const SUFFICIENT: f64 = 1e-4;
/// Rounding of a cost, as a share of it.
const COST_ROUNDING: f64 = 1e-14;
/// Steps below this share of half the range may fail to make the cost fall by rounding alone.
const ROUNDING_STEP: f64 = 1e-6;

/// Across the box a quadratic model may be wrong by this share of the cost.
const FLAT_SHARE: f64 = 1e-2;
/// Points across the box that may be looked at: corners and sides of two variables.
const MAX_ACROSS: usize = 8;

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ending {
    /// At the optimum.
    Converged,
    /// At the best point found within the bound of work that leaves all margins.
    WorkLimit,
    /// No point that leaves all margins: at the largest smallest margin found.
    NoMargin,
    /// At a point where the problem is no number.
    NotFinite,
}

/// Where a search ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct Minimum<const N: usize> {
    pub(super) z: [f64; N],
    pub(super) ending: Ending,
    pub(super) cost: f64,
    pub(super) iterations: usize,
    pub(super) evaluations: usize,
}

/// A search: the problem, and how much was asked of it.
struct Search<F, const N: usize> {
    evaluate: F,
    evaluations: usize,
    iterations: usize,
    /// The cheapest point that leaves all margins.
    cheapest: Option<([f64; N], f64)>,
    /// The point with the largest smallest margin.
    safest: ([f64; N], f64, f64),
}

/// Minimises from `start`, in the box from -1 to 1.
pub(super) fn minimise<const N: usize>(
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
    let Some(mut here) = search.look(&start) else {
        return search.end(start, Ending::NotFinite);
    };
    let mut z = start;
    let (mut raised, mut elsewhere) = (false, None);
    loop {
        match search.descend(z, here) {
            Descent::Done(bottom) => {
                // where the cost curves down, there may be a lower bottom on another side
                if elsewhere.is_none() && bottom.curves_down {
                    elsewhere = Some(bottom);
                    if let Some(there) = search.elsewhere(&bottom) {
                        (z, here) = there;
                        continue;
                    }
                }
                let lowest = elsewhere.filter(|first| first.cost < bottom.cost);
                let lowest = lowest.unwrap_or(bottom);
                return search.ended(lowest.z, Ending::Converged, lowest.cost);
            }
            Descent::Stuck => return search.settle(),
            Descent::NoMargin(at, evaluation) if !raised => {
                raised = true;
                (z, here) = search.raise(at, evaluation);
                if here.least_margin() < -MARGIN_TOLERANCE {
                    return search.settle();
                }
            }
            Descent::NoMargin(..) => return search.settle(),
        }
    }
}

/// The end of a descent.
#[derive(Debug, Clone, Copy)]
struct Bottom<const N: usize> {
    z: [f64; N],
    cost: f64,
    gradient: [f64; N],
    hessian: [[f64; N]; N],
    /// Whether the quadratic model curves down in some direction.
    curves_down: bool,
}

/// How a descent ended.
enum Descent<const N: usize> {
    Done(Bottom<N>),
    Stuck,
    /// The linearised margins cannot be met from here.
    NoMargin([f64; N], Evaluation<N>),
}

impl<F: FnMut(&[f64; N]) -> Evaluation<N>, const N: usize> Search<F, N> {
    /// The problem at a point; `None` where it is no number, or the work is used up.
    fn look(&mut self, z: &[f64; N]) -> Option<Evaluation<N>> {
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

    /// The cheapest point across the box, if it is cheaper than a bottom: of those looked at where the quadratic
    /// model is lower, or hardly higher.
    fn elsewhere(&mut self, bottom: &Bottom<N>) -> Option<([f64; N], Evaluation<N>)> {
        let mut cheapest: Option<([f64; N], Evaluation<N>)> = None;
        // with two variables there are too many ways across to try those that are hardly higher
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
                .look(&there)
                .filter(|at| at.least_margin() >= -MARGIN_TOLERANCE && at.cost < least);
            cheapest = found.map(|at| (there, at)).or(cheapest);
        }
        cheapest
    }

    fn descend(&mut self, mut z: [f64; N], mut here: Evaluation<N>) -> Descent<N> {
        let mut penalty: f64 = 0.0;
        let mut learnt = [[0.0; N]; N];
        // how much a step is smaller than the one before
        let mut before = 1.0;
        while self.iterations < MAX_ITERATIONS {
            let hessian = sum(&here.curvature, &learnt);
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
                // nothing falls any more: rounding, if the step is small
                return if size <= ROUNDING_STEP {
                    Descent::Done(bottom(z, &here, &hessian))
                } else {
                    Descent::Stuck
                };
            };
            let step: [f64; N] = std::array::from_fn(|i| there[i] - z[i]);
            learn(&mut learnt, &step, &next.bending(&here, &multipliers));
            (z, here, before) = (there, next, size * share);
        }
        Descent::Stuck
    }

    /// The first of the halvings of a step that makes cost plus violation fall enough.
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
            if let Some(at) = self.look(&there).filter(|at| merit(at) <= enough) {
                return Some((there, at, share));
            }
            share *= 0.5;
        }
        None
    }

    /// Raises the smallest margin as far as it goes.
    fn raise(&mut self, mut z: [f64; N], mut here: Evaluation<N>) -> ([f64; N], Evaluation<N>) {
        let mut share: f64 = 1.0;
        while self.iterations < MAX_ITERATIONS {
            let (d, promised) = raising_step(&z, &here);
            if promised < here.least_margin() + WORTH_RAISING {
                break;
            }
            self.iterations += 1;
            // where the last step had to be shortened, this one may have to be
            share = (2.0 * share).min(1.0);
            let mut found = None;
            for _ in 0..=MAX_HALVINGS {
                let there = moved(&z, &d, share);
                let worth = here.least_margin() + WORTH_RAISING;
                if let Some(at) = self.look(&there).filter(|at| at.least_margin() > worth) {
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

    /// The best that was seen.
    fn settle(&self) -> Minimum<N> {
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

/// Makes a symmetric matrix give `bending` for `step` by the least change that keeps it symmetric (Powell's
/// update): what was learnt across the step stays.
fn learn<const N: usize>(learnt: &mut [[f64; N]; N], step: &[f64; N], bending: &[f64; N]) {
    let square = dot(step, step);
    if !(square > 0.0) {
        return;
    }
    let miss: [f64; N] = std::array::from_fn(|i| bending[i] - dot(&learnt[i], step));
    let along = dot(&miss, step) / square;
    for i in 0..N {
        for j in 0..N {
            let both = miss[i] * step[j] + step[i] * miss[j] - along * step[i] * step[j];
            learnt[i][j] += both / square;
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

/// How far the margins are missed, all together.
fn violation<const N: usize>(at: &Evaluation<N>) -> f64 {
    at.margins()
        .iter()
        .map(|margin| (-margin.value).max(0.0))
        .sum()
}

/// z + share d, in the box.
fn moved<const N: usize>(z: &[f64; N], d: &[f64; N], share: f64) -> [f64; N] {
    std::array::from_fn(|i| (z[i] + d[i] * share).clamp(-1.0, 1.0))
}
