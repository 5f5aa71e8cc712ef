//! The least cost over the box that leaves every margin: sequential quadratic programming with exact
//! second derivatives, of bounded work.
//!
//! Each iteration takes the exact optimum of the quadratic model ([`quadratic_step`]) and halves it until
//! cost plus violation falls enough. Where the linearised margins cannot be met, the smallest margin is
//! raised instead. Every iterate lies in the box.

use super::evaluation::{Evaluation, MAX_MARGINS};
use super::quadratic_step::{dot, quadratic_step};
use super::raise::raising_step;

/// Most evaluations of a problem, whatever it is.
pub(super) const MAX_EVALUATIONS: usize = 40;
/// Most iterations.
pub(super) const MAX_ITERATIONS: usize = 12;
/// Most halvings of a step.
const MAX_HALVINGS: usize = 6;
/// Steps below this share of half the range are taken unseen: what is left is their square.
const LAST_STEP: f64 = 1e-7;
/// A margin may be missed by this much.
const MARGIN_TOLERANCE: f64 = 1e-9;
/// Armijo's share of the decrease that the slope promises.
const SUFFICIENT: f64 = 1e-4;
/// Rounding of a cost, as a share of it.
const COST_ROUNDING: f64 = 1e-14;

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
    let start = start.map(|z| z.max(-1.0).min(1.0));
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
    let mut raised = false;
    loop {
        match search.descend(z, here) {
            Descent::Done(z) => return search.end(z, Ending::Converged),
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

/// How a descent ended.
enum Descent<const N: usize> {
    Done([f64; N]),
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
        let (margin, cost) = (found.least_margin(), found.cost.value);
        let cheaper = self.cheapest.is_none_or(|(_, least)| cost < least);
        if margin >= -MARGIN_TOLERANCE && cheaper {
            self.cheapest = Some((*z, cost));
        }
        if margin > self.safest.1 {
            self.safest = (*z, margin, cost);
        }
        Some(found)
    }

    fn descend(&mut self, mut z: [f64; N], mut here: Evaluation<N>) -> Descent<N> {
        let mut multipliers = [0.0; MAX_MARGINS];
        let mut penalty: f64 = 0.0;
        while self.iterations < MAX_ITERATIONS {
            let Some(step) = quadratic_step(&z, &here, &multipliers) else {
                return Descent::NoMargin(z, here);
            };
            multipliers = step.multipliers;
            let size = step.d.iter().fold(0.0, |size: f64, d| size.max(d.abs()));
            if size <= LAST_STEP {
                return Descent::Done(moved(&z, &step.d, 1.0));
            }
            self.iterations += 1;
            let largest = multipliers.iter().fold(0.0, |a: f64, &b| a.max(b));
            penalty = penalty.max(2.0 * largest);
            if here.least_margin() < -MARGIN_TOLERANCE {
                penalty = penalty.max(here.cost.value.abs() + 1.0);
            }
            let merit = |at: &Evaluation<N>| at.cost.value + penalty * violation(at);
            let before = merit(&here);
            let slope = dot(&here.cost.gradient, &step.d) - penalty * violation(&here);
            let rounding = COST_ROUNDING * before.abs();
            let mut share = 1.0;
            let mut found = None;
            for _ in 0..=MAX_HALVINGS {
                let there = moved(&z, &step.d, share);
                if let Some(at) = self.look(&there) {
                    if merit(&at) <= before + SUFFICIENT * share * slope.min(0.0) + rounding {
                        found = Some((there, at));
                        break;
                    }
                }
                share *= 0.5;
            }
            let Some(next) = found else {
                return Descent::Stuck;
            };
            (z, here) = next;
        }
        Descent::Stuck
    }

    /// Raises the smallest margin as far as it goes.
    fn raise(&mut self, mut z: [f64; N], mut here: Evaluation<N>) -> ([f64; N], Evaluation<N>) {
        while self.iterations < MAX_ITERATIONS {
            self.iterations += 1;
            let d = raising_step(&z, &here);
            let mut share = 1.0;
            let mut found = None;
            for _ in 0..=MAX_HALVINGS {
                let there = moved(&z, &d, share);
                if let Some(at) = self.look(&there) {
                    if at.least_margin() > here.least_margin() + MARGIN_TOLERANCE {
                        found = Some((there, at));
                        break;
                    }
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

/// How far the smallest margin is missed.
fn violation<const N: usize>(at: &Evaluation<N>) -> f64 {
    at.margins()
        .iter()
        .map(|margin| (-margin.value).max(0.0))
        .sum()
}

/// z + share d, in the box.
fn moved<const N: usize>(z: &[f64; N], d: &[f64; N], share: f64) -> [f64; N] {
    std::array::from_fn(|i| (z[i] + d[i] * share).max(-1.0).min(1.0))
}
