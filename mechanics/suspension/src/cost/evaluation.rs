//! Evaluation of a problem at one point: its cost and its margins to the constraints.
//!
//! The cost is a convex function phi of the margins m (loads and angles), so its derivatives with respect to the
//! problem's variables are
//! ```text
//!     S(11)  dJ = sum phi_i dm_i,   d2J = sum phi_ij dm_i dm_j' + sum phi_i d2m_i
//! ```
//! Everything except the last sum, the curvature of the margins, is known at one point.

use super::weights::Weights;
use tipwatch_mechanics::machine::MAX_WHEELS;
use tipwatch_mechanics::number::{Gradient, Real};

/// Maximum number of margins: one load per wheel and one angle per edge.
pub(crate) const MAX_MARGINS: usize = 2 * MAX_WHEELS;

/// Cost and margins with their derivatives with respect to the variables, which are scaled to -1..1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Evaluation<const N: usize> {
    pub(crate) cost: f64,
    /// dJ.
    pub(crate) gradient: [f64; N],
    /// The known part of d2J, positive semidefinite.
    pub(crate) curvature: [[f64; N]; N],
    /// Constraints, required to be non-negative: loads relative to the mean load, angles minus their bound (rad).
    margins: [Gradient<N>; MAX_MARGINS],
    /// phi_i
    partials: [f64; MAX_MARGINS],
    count: usize,
}

impl<const N: usize> Evaluation<N> {
    /// Returns the evaluation for the signed loads (N), the mean load (N), the stability angles (rad) and their lower bound.
    pub(crate) fn of(
        weights: &Weights,
        loads: &[Gradient<N>],
        mean_load: f64,
        angles: &[Gradient<N>],
        least_angle: f64,
    ) -> Self {
        let mut at = Self {
            cost: weights.cost(
                loads.iter().map(|n| n.value),
                angles.iter().map(|a| a.value),
            ),
            gradient: [0.0; N],
            curvature: [[0.0; N]; N],
            margins: [Gradient::fixed(0.0); MAX_MARGINS],
            partials: [0.0; MAX_MARGINS],
            count: (loads.len() + angles.len()).min(MAX_MARGINS),
        };
        let (of_loads, of_angles) = at.partials.split_at_mut(loads.len().min(MAX_MARGINS));
        weights.partials(loads, angles, of_loads, of_angles, |slopes, by| {
            for i in 0..N {
                for j in 0..N {
                    at.curvature[i][j] += by * slopes[i] * slopes[j];
                }
            }
        });
        for (partial, from) in at.partials.iter().zip(loads.iter().chain(angles)) {
            for i in 0..N {
                at.gradient[i] += partial * from.slopes[i];
            }
        }
        let loads = loads
            .iter()
            .map(|load| (load.scaled(1.0 / mean_load), mean_load));
        let least = Gradient::fixed(least_angle);
        let angles = angles.iter().map(|&angle| (angle - least, 1.0));
        let places = at.margins.iter_mut().zip(&mut at.partials);
        for ((margin, partial), (value, unit)) in places.zip(loads.chain(angles)) {
            *margin = value;
            *partial *= unit;
        }
        at
    }

    pub(crate) fn margins(&self) -> &[Gradient<N>] {
        &self.margins[..self.count]
    }

    pub(crate) fn least_margin(&self) -> f64 {
        let values = self.margins().iter().map(|margin| margin.value);
        values.fold(f64::INFINITY, f64::min)
    }

    /// Whether every value that a step needs is finite.
    pub(crate) fn is_finite(&self) -> bool {
        // A sum is finite if its terms are, except for overflow, which is not usable either.
        let mut sum = self.cost;
        sum += self
            .gradient
            .iter()
            .chain(self.curvature.iter().flatten())
            .sum::<f64>();
        for margin in self.margins() {
            sum += margin.value + margin.slopes.iter().sum::<f64>();
        }
        sum.is_finite()
    }

    /// Effect of the unknown part of the Hessian of the Lagrangian on the way from another point to this one, to
    /// first order: sum (phi_i - l_i) (dm_i - dm_i there).
    pub(crate) fn unknown_curvature(
        &self,
        from: &Self,
        multipliers: &[f64; MAX_MARGINS],
    ) -> [f64; N] {
        let mut unknown_curvature = [0.0; N];
        for k in 0..self.count {
            let partial = self.partials[k] - multipliers[k];
            for (i, sum) in unknown_curvature.iter_mut().enumerate() {
                *sum += partial * (self.margins[k].slopes[i] - from.margins[k].slopes[i]);
            }
        }
        unknown_curvature
    }
}
