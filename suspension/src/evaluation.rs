//! What a problem is at one point: its cost and how far it is from what must not be.
//!
//! The cost is a convex function phi of the margins m (loads and angles), so its derivatives by the
//! problem's variables are
//! ```text
//!     S(11)  dJ = sum phi_i dm_i,   d2J = sum phi_ij dm_i dm_j' + sum phi_i d2m_i
//! ```
//! of which all but the last sum, the curvature of the margins themselves, is known at one point.

use crate::weights::Weights;
use tipwatch_mechanics::machine::MAX_WHEELS;
use tipwatch_mechanics::number::{Gradient, Real};

/// Most margins: a load of every wheel and an angle of every edge.
pub(super) const MAX_MARGINS: usize = 2 * MAX_WHEELS;

/// Cost and margins with their derivatives by the problem's variables, which run from -1 to 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evaluation<const N: usize> {
    pub(super) cost: f64,
    /// dJ.
    pub(super) gradient: [f64; N],
    /// The known part of d2J, positive semidefinite.
    pub(super) curvature: [[f64; N]; N],
    /// Loads as shares of the mean load, angles above the least in rad: what must not be negative.
    margins: [Gradient<N>; MAX_MARGINS],
    /// phi_i
    prices: [f64; MAX_MARGINS],
    count: usize,
}

impl<const N: usize> Evaluation<N> {
    /// From the signed loads (N), the mean load (N), the stability angles (rad) and their least.
    pub(super) fn of(
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
            prices: [0.0; MAX_MARGINS],
            count: (loads.len() + angles.len()).min(MAX_MARGINS),
        };
        let (of_loads, of_angles) = at.prices.split_at_mut(loads.len().min(MAX_MARGINS));
        weights.prices(loads, angles, of_loads, of_angles, |slopes, by| {
            for i in 0..N {
                for j in 0..N {
                    at.curvature[i][j] += by * slopes[i] * slopes[j];
                }
            }
        });
        for (price, from) in at.prices.iter().zip(loads.iter().chain(angles)) {
            for i in 0..N {
                at.gradient[i] += price * from.slopes[i];
            }
        }
        let loads = loads
            .iter()
            .map(|load| (load.scaled(1.0 / mean_load), mean_load));
        let least = Gradient::fixed(least_angle);
        let angles = angles.iter().map(|&angle| (angle - least, 1.0));
        let places = at.margins.iter_mut().zip(&mut at.prices);
        for ((margin, price), (value, unit)) in places.zip(loads.chain(angles)) {
            *margin = value;
            *price *= unit;
        }
        at
    }

    pub(super) fn margins(&self) -> &[Gradient<N>] {
        &self.margins[..self.count]
    }

    pub(super) fn least_margin(&self) -> f64 {
        let values = self.margins().iter().map(|margin| margin.value);
        values.fold(f64::INFINITY, f64::min)
    }

    /// Whether every number that a step needs is finite.
    pub(super) fn is_finite(&self) -> bool {
        // a sum is finite where its parts are, but for overflow, which is no number to go on with
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

    /// What the unknown part of the Hessian of cost less multipliers times margins gives on the way
    /// from another point to this one, to first order: sum (phi_i - l_i) (dm_i - dm_i there).
    pub(super) fn bending(&self, from: &Self, multipliers: &[f64; MAX_MARGINS]) -> [f64; N] {
        let mut bending = [0.0; N];
        for k in 0..self.count {
            let price = self.prices[k] - multipliers[k];
            for (i, sum) in bending.iter_mut().enumerate() {
                *sum += price * (self.margins[k].slopes[i] - from.margins[k].slopes[i]);
            }
        }
        bending
    }
}
