//! What a problem is at one point: its cost and how far it is from what must not be.

use crate::machine::MAX_WHEELS;
use crate::number::SecondOrder;

/// Most margins: a load of every wheel and an angle of every edge.
pub(super) const MAX_MARGINS: usize = 2 * MAX_WHEELS;

/// Cost and margins with their first and second derivatives by the problem's variables, which run from
/// -1 to 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evaluation<const N: usize> {
    pub(super) cost: SecondOrder<f64, N>,
    margins: [SecondOrder<f64, N>; MAX_MARGINS],
    count: usize,
}

impl<const N: usize> Evaluation<N> {
    pub(super) fn new(cost: SecondOrder<f64, N>) -> Self {
        Self {
            cost,
            margins: [SecondOrder::fixed(0.0); MAX_MARGINS],
            count: 0,
        }
    }

    /// Adds a margin, of the order of one, that must not be negative.
    pub(super) fn add_margin(&mut self, margin: SecondOrder<f64, N>) {
        if let Some(place) = self.margins.get_mut(self.count) {
            *place = margin;
            self.count += 1;
        }
    }

    pub(super) fn margins(&self) -> &[SecondOrder<f64, N>] {
        &self.margins[..self.count]
    }

    pub(super) fn least_margin(&self) -> f64 {
        let values = self.margins().iter().map(|margin| margin.value);
        values.fold(f64::INFINITY, f64::min)
    }

    /// Whether every number that a step needs is finite.
    pub(super) fn is_finite(&self) -> bool {
        let finite = |x: &SecondOrder<f64, N>| {
            // a sum is finite where its parts are, but for overflow, which is no number to go on with
            let sum: f64 = x.gradient.iter().chain(x.hessian.iter().flatten()).sum();
            (x.value + sum).is_finite()
        };
        finite(&self.cost) && self.margins().iter().all(finite)
    }

    /// Hessian of cost less multipliers times margins.
    pub(super) fn lagrangian_hessian(&self, multipliers: &[f64; MAX_MARGINS]) -> [[f64; N]; N] {
        let mut hessian = self.cost.hessian;
        for (margin, &multiplier) in self.margins().iter().zip(multipliers) {
            if multiplier > 0.0 {
                for i in 0..N {
                    for j in 0..N {
                        hessian[i][j] -= multiplier * margin.hessian[i][j];
                    }
                }
            }
        }
        hessian
    }
}
