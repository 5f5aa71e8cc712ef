//! Sums of derivatives over many rows.

use super::derivatives::Sensitivity;
use crate::machine::{Machine, Parameter};
use crate::number::{Lanes, Mask, Real};

/// Sums of squared derivatives of the loads over rows; rows with an unknown derivative are excluded.
#[derive(Debug, Clone)]
pub struct SensitivitySums {
    /// By wheel and parameter, in the order of [`Parameter::all`].
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

/// The same sums while rows are evaluated in lanes.
#[derive(Debug)]
pub(crate) struct LaneSums {
    squares: Vec<Vec<Lanes>>,
    rows: Vec<Lanes>,
}

impl LaneSums {
    pub(crate) fn new(machine: &Machine) -> Self {
        let (wheels, size) = (machine.wheels.len(), Parameter::all(machine).len());
        Self {
            squares: vec![vec![Lanes::constant(0.0); size]; wheels],
            rows: vec![Lanes::constant(0.0); wheels],
        }
    }

    /// Adds the first `count` lanes. An unknown derivative makes the root mean square unknown.
    pub(crate) fn add(
        &mut self,
        sensitivity: &Sensitivity<Lanes>,
        load_sigma: &[Lanes],
        count: usize,
    ) {
        let place: [f64; Lanes::COUNT] = std::array::from_fn(|lane| lane as f64);
        let inside = Lanes::from_array(place).lt(Lanes::constant(count as f64));
        let (zero, one) = (Lanes::constant(0.0), Lanes::constant(1.0));
        for (wheel, squares) in self.squares.iter_mut().enumerate() {
            let known = load_sigma[wheel].lt(Lanes::constant(f64::INFINITY));
            let counted = inside & known;
            self.rows[wheel] += Lanes::select(counted, one, zero);
            let derivatives = &sensitivity.loads_of_groups()[wheel];
            if (!counted).any() {
                let pairs = squares.iter_mut().zip(derivatives);
                pairs.for_each(|(sum, &by)| *sum += Lanes::select(counted, by * by, zero));
                continue;
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
    }

    /// Forgets all rows.
    pub(crate) fn clear(&mut self) {
        let zero = Lanes::constant(0.0);
        for squares in &mut self.squares {
            squares.fill(zero);
        }
        self.rows.fill(zero);
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
