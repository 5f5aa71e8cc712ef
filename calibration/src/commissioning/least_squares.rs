//! Linear least squares with standard deviations that allow for errors alike in neighbouring bins.

use nalgebra::{DMatrix, DVector};

/// Equations `sum_k a_k x_k = y`, in runs of neighbouring bins.
#[derive(Debug, Clone)]
pub(super) struct Equations {
    unknowns: usize,
    rows: Vec<f64>,
    right: Vec<f64>,
    /// Least standard deviation of a column: of less, noise would be taken for motion.
    least: Vec<(usize, f64)>,
}

/// Their solution.
#[derive(Debug, Clone)]
pub(super) struct Solution {
    pub(super) values: Vec<f64>,
    /// Standard deviation of each value.
    pub(super) sigmas: Vec<f64>,
}

impl Solution {
    /// An unknown and its standard deviation.
    pub(super) fn of(&self, unknown: usize) -> [f64; 2] {
        [self.values[unknown], self.sigmas[unknown]]
    }
}

impl Equations {
    pub(super) fn new(unknowns: usize) -> Self {
        Self {
            unknowns,
            rows: Vec::new(),
            right: Vec::new(),
            least: Vec::new(),
        }
    }

    /// Returns the equations with a condition: they have no solution where this column varies by less than `least` (standard
    /// deviation).
    pub(super) fn excited(mut self, column: usize, least: f64) -> Self {
        self.least.push((column, least));
        self
    }

    fn is_excited(&self) -> bool {
        self.least.iter().all(|&(column, least)| {
            let values = self.rows.chunks_exact(self.unknowns).map(|row| row[column]);
            let count = self.right.len() as f64;
            let mean = values.clone().sum::<f64>() / count;
            let variance = values.map(|v| (v - mean).powi(2)).sum::<f64>() / count;
            variance.sqrt() >= least
        })
    }

    /// Adds an equation; one with a number that is not finite is left out.
    pub(super) fn add(&mut self, row: &[f64], right: f64) {
        if right.is_finite() && row.iter().all(|a| a.is_finite()) {
            self.rows.extend_from_slice(row);
            self.right.push(right);
        }
    }

    /// The solution; `None` where the equations do not determine it.
    pub(super) fn solve(&self) -> Option<Solution> {
        let (count, unknowns) = (self.right.len(), self.unknowns);
        if count < 3 * unknowns || !self.is_excited() {
            return None;
        }
        let mut normal = DMatrix::zeros(unknowns, unknowns);
        let mut product = DVector::zeros(unknowns);
        let rows = || self.rows.chunks_exact(unknowns).zip(&self.right);
        for (row, right) in rows() {
            for (i, a) in row.iter().enumerate() {
                product[i] += a * right;
                for (j, b) in row.iter().enumerate().take(i + 1) {
                    normal[(i, j)] += a * b;
                }
            }
        }
        normal.fill_upper_triangle_with_lower_triangle();
        // Columns of one length, so that the determination does not depend on units.
        let scale = normal.diagonal().map(|d: f64| 1.0 / d.sqrt());
        if !scale.iter().all(|s| s.is_finite()) {
            return None;
        }
        let diagonal = DMatrix::from_diagonal(&scale);
        let inverse = (&diagonal * normal * &diagonal).try_inverse()?;
        if !inverse.iter().all(|v| v.is_finite() && v.abs() < 1e6) {
            return None;
        }
        let inverse = &diagonal * inverse * &diagonal;
        let values = &inverse * product;
        let left = |(row, right): (&[f64], &f64)| {
            right
                - row
                    .iter()
                    .zip(values.iter())
                    .map(|(a, x)| a * x)
                    .sum::<f64>()
        };
        let residual: Vec<f64> = rows().map(left).collect();
        let squares: f64 = residual.iter().map(|e| e * e).sum();
        let variance = squares / (count - unknowns) as f64;
        let alike = alike(&residual);
        let sigma = |k: usize| (variance * inverse[(k, k)] * alike).sqrt();
        Some(Solution {
            values: values.iter().copied().collect(),
            sigmas: (0..unknowns).map(sigma).collect(),
        })
    }
}

/// Computes from the autocorrelation r at one step how many neighbouring residuals count as one: (1 + r) / (1 - r).
pub(super) fn alike(residuals: &[f64]) -> f64 {
    let all: f64 = residuals.iter().map(|e| e * e).sum();
    let neighbours: f64 = residuals.windows(2).map(|pair| pair[0] * pair[1]).sum();
    let r = (neighbours / all).clamp(0.0, 0.95);
    if r.is_finite() {
        (1.0 + r) / (1.0 - r)
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_with_its_sigma() {
        let mut equations = Equations::new(2);
        for k in 0..100 {
            let x = f64::from(k) * 0.1;
            let error = if k % 2 == 0 { 0.01 } else { -0.01 };
            equations.add(&[x, 1.0], 2.0 * x - 1.0 + error);
        }
        equations.add(&[1.0, f64::NAN], 1e9);
        let found = equations.solve().unwrap();
        assert!((found.values[0] - 2.0).abs() < 1e-3 && (found.values[1] + 1.0).abs() < 5e-3);
        assert!((1e-4..1e-3).contains(&found.sigmas[0]));
    }

    #[test]
    fn what_is_not_excited_is_not_determined() {
        let mut equations = Equations::new(2);
        (0..50).for_each(|_| equations.add(&[1.0, 1.0], 3.0));
        assert!(equations.solve().is_none());
        assert!(Equations::new(1).solve().is_none());
    }
}
