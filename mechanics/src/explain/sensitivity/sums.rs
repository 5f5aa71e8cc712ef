//! Sums of derivatives over many rows.

use super::derivatives::GroupDerivatives;
use crate::machine::{Machine, Parameter};
use crate::number::{Lanes, Mask, Real};

/// Sums of squared derivatives of the loads over rows; rows with an unknown derivative are excluded.
#[derive(Debug, Clone)]
pub struct SensitivitySums {
    /// Sums of squares by wheel and parameter, in the order of [`Parameter::all`].
    squares: Vec<Vec<f64>>,
    /// Number of rows counted, by wheel.
    rows: Vec<f64>,
}

impl SensitivitySums {
    /// Sums over no rows.
    #[must_use]
    pub fn none(machine: &Machine) -> Self {
        let (wheels, size) = (machine.wheels.len(), Parameter::all(machine).len());
        Self {
            squares: vec![vec![0.0; size]; wheels],
            rows: vec![0.0; wheels],
        }
    }

    /// Root mean square of a wheel's derivatives, in the order of [`Parameter::all`]; NaN without rows.
    #[must_use]
    pub fn root_mean_squares(&self, wheel: usize) -> Vec<f64> {
        let rows = self.rows[wheel];
        let squares = self.squares[wheel].iter();
        squares.map(|sum| (sum / rows).sqrt()).collect()
    }

    /// Adds the sums of other rows.
    pub fn add(&mut self, other: &Self) {
        for (mine, others) in self.squares.iter_mut().zip(&other.squares) {
            for (mine, other) in mine.iter_mut().zip(others) {
                *mine += other;
            }
        }
        for (mine, other) in self.rows.iter_mut().zip(&other.rows) {
            *mine += other;
        }
    }
}

/// Sums of squares while rows are evaluated, by group of wheels that are side by side.
#[derive(Debug)]
pub(crate) struct SquareSums<V: Real> {
    squares: Vec<Vec<V>>,
    rows: Vec<V>,
    /// The samples that count.
    inside: V::Mask,
}

impl<V: Real> SquareSums<V> {
    /// Adds the derivatives of a group of wheels. An unknown derivative makes the root mean square unknown, as it makes
    /// `load_sigma` unknown, the standard deviations of these loads.
    #[inline(always)]
    pub(crate) fn add(&mut self, derivatives: &GroupDerivatives<'_, V>, load_sigma: V) {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let counted = self.inside & load_sigma.lt(V::constant(f64::INFINITY));
        self.rows[derivatives.group] += V::select(counted, one, zero);
        let squares = &mut self.squares[derivatives.group];
        let derivatives = derivatives.of_loads();
        if (!counted).any() {
            let pairs = squares.iter_mut().zip(derivatives);
            pairs.for_each(|(sum, &by)| *sum += V::select(counted, by * by, zero));
            return;
        }
        let (sums, last_sums) = squares.as_chunks_mut::<4>();
        let (by, last_by) = derivatives.as_chunks::<4>();
        for (sums, by) in sums.iter_mut().zip(by) {
            for (sum, by) in sums.iter_mut().zip(by) {
                *sum += *by * *by;
            }
        }
        for (sum, by) in last_sums.iter_mut().zip(last_by) {
            *sum += *by * *by;
        }
    }

    /// Forgets all rows.
    pub(crate) fn clear(&mut self) {
        let zero = V::constant(0.0);
        for squares in &mut self.squares {
            squares.fill(zero);
        }
        self.rows.fill(zero);
    }
}

/// One wheel after the other, of the samples of a register.
impl SquareSums<Lanes> {
    pub(crate) fn new(machine: &Machine) -> Self {
        let (wheels, size) = (machine.wheels.len(), Parameter::all(machine).len());
        Self {
            squares: vec![vec![Lanes::constant(0.0); size]; wheels],
            rows: vec![Lanes::constant(0.0); wheels],
            inside: Mask::splat(true),
        }
    }

    /// Makes the sums count only the first `count` lanes of later rows.
    pub(crate) fn count_first(&mut self, count: usize) {
        let place: [f64; Lanes::COUNT] = std::array::from_fn(|lane| lane as f64);
        self.inside = Lanes::from_array(place).lt(Lanes::constant(count as f64));
    }

    /// Writes the sums over the lanes, starting with the first.
    pub(crate) fn write_total(&self, out: &mut SensitivitySums) {
        let total = |lanes: &Lanes| lanes.to_array().iter().sum();
        for (out, squares) in out.squares.iter_mut().zip(&self.squares) {
            for (out, lanes) in out.iter_mut().zip(squares) {
                *out = total(lanes);
            }
        }
        for (out, lanes) in out.rows.iter_mut().zip(&self.rows) {
            *out = total(lanes);
        }
    }
}
