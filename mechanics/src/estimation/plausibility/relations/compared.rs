//! What the lean of a window is compared with: its equation, linear in what is not known.

use nalgebra::{SVector, Vector2};

use super::likelihood::Mixture;
use super::unknowns::Unknowns;

/// Number of unknowns: bias about x and y, compliance about x and y, load, and what is drawn anew in each window.
pub(super) const UNKNOWNS: usize = 6;
const LEANS: Mixture = Mixture {
    outliers: 0.05,
    range: 0.02,
};

/// What is compared in a window.
pub(super) struct Compared {
    pub(super) start_ns: i64,
    pub(super) window_s: f64,
    pub(super) sigma: Vector2<f64>,
    pub(super) measured: Vector2<f64>,
    pub(super) per_load: Vector2<f64>,
    pub(super) by_load: Vector2<f64>,
    pub(super) least_compliance: f64,
}

impl Compared {
    /// The row of the unknowns about an axis.
    fn row(&self, axis: usize, a: &Vector2<f64>, drawn: &Vector2<f64>) -> SVector<f64, UNKNOWNS> {
        let mut row = SVector::zeros();
        row[axis] = self.window_s;
        row[2 + axis] = a[axis];
        row[4] = self.per_load[axis];
        row[5] = drawn[axis];
        row
    }

    /// Log density of the measured lean, and what it teaches of the unknowns.
    pub(super) fn take(
        &self,
        unknowns: &mut Unknowns<UNKNOWNS>,
        measured: &Vector2<f64>,
        a: &Vector2<f64>,
        drawn: Vector2<f64>,
    ) -> f64 {
        let mut sum = 0.0;
        for axis in 0..2 {
            let row = self.row(axis, a, &drawn);
            sum += unknowns.take(&row, measured[axis], self.sigma[axis], LEANS);
        }
        for compliance in 2..4 {
            unknowns.mean[compliance] = unknowns.mean[compliance].max(self.least_compliance);
        }
        sum
    }

    /// Log density of the measured lean in a direction, with `drawn` by the last unknown and `aside` more of scatter (rad), and
    /// what it teaches.
    pub(super) fn take_along(
        &self,
        unknowns: &mut Unknowns<UNKNOWNS>,
        direction: &Vector2<f64>,
        a: &Vector2<f64>,
        drawn: f64,
        aside: f64,
    ) -> f64 {
        let none = Vector2::zeros();
        let mut row = self.row(0, a, &none) * direction.x + self.row(1, a, &none) * direction.y;
        row[UNKNOWNS - 1] = drawn;
        let sigma = direction.component_mul(&self.sigma).norm().hypot(aside);
        unknowns.take(&row, direction.dot(&self.measured), sigma, LEANS)
    }

    pub(super) fn residual(&self, unknowns: &Unknowns<UNKNOWNS>, a: &Vector2<f64>) -> Vector2<f64> {
        let of = |axis: usize| {
            let row = self.row(axis, a, &Vector2::zeros());
            self.measured[axis] - row.dot(&unknowns.mean)
        };
        Vector2::new(of(0), of(1))
    }
}
