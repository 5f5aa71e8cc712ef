//! Unknowns that a relation learns: biases, compliance, a load.

use nalgebra::{SMatrix, SVector};

use super::likelihood::Mixture;

/// Unknown numbers with their covariance, updated window by window (Kalman filter). A residual in the tails of the
/// distribution counts less: by the weight of Student's t.
#[derive(Debug, Clone, Copy)]
pub(super) struct Unknowns<const N: usize> {
    pub(super) mean: SVector<f64, N>,
    covariance: SMatrix<f64, N, N>,
}

impl<const N: usize> Unknowns<N> {
    /// Unknown numbers with these means and standard deviations.
    pub(super) fn new(mean: SVector<f64, N>, sigma: SVector<f64, N>) -> Self {
        Self {
            mean,
            covariance: SMatrix::from_diagonal(&sigma.component_mul(&sigma)),
        }
    }

    /// Lets the unknowns change by these standard deviations.
    pub(super) fn drift(&mut self, sigma: SVector<f64, N>) {
        self.covariance += SMatrix::from_diagonal(&sigma.component_mul(&sigma));
    }

    /// Draws one of the unknowns anew, with this standard deviation.
    pub(super) fn draw(&mut self, index: usize, sigma: f64) {
        self.mean[index] = 0.0;
        self.covariance.column_mut(index).fill(0.0);
        self.covariance.row_mut(index).fill(0.0);
        self.covariance[(index, index)] = sigma * sigma;
    }

    /// Takes `measured = row . unknowns + noise` and returns the logarithm of its density.
    ///
    /// ```text
    ///     s^2 = row' P row + sigma^2,     w = min(5 / (4 + z^2), 1),  z = residual / s
    ///     K = P row / (row' P row + sigma^2 / w)
    /// ```
    pub(super) fn take(
        &mut self,
        row: &SVector<f64, N>,
        measured: f64,
        sigma: f64,
        mixture: Mixture,
    ) -> f64 {
        let residual = measured - row.dot(&self.mean);
        let spread = self.covariance * row;
        let unknown = row.dot(&spread).max(0.0);
        let variance = unknown + sigma * sigma;
        let log_density = mixture.log_density(residual, variance.sqrt());
        let weight = (5.0 / (4.0 + residual * residual / variance)).min(1.0);
        let gain = spread / (unknown + sigma * sigma / weight);
        // Written so that NaN is not learned.
        if log_density.is_finite() && gain.iter().all(|g| g.is_finite()) {
            self.mean += gain * residual;
            self.covariance -= gain * spread.transpose();
        }
        log_density
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIXTURE: Mixture = Mixture {
        outliers: 0.02,
        range: 100.0,
    };

    #[test]
    fn a_line_is_learned_and_an_outlier_is_not() {
        let mut line = Unknowns::new(SVector::from([0.0, 0.0]), SVector::from([10.0, 10.0]));
        for k in 0..200 {
            let x = f64::from(k % 17) * 0.1;
            let outlier = if k % 40 == 39 { 50.0 } else { 0.0 };
            let row = SVector::from([1.0, x]);
            line.take(&row, 2.0 - 0.5 * x + outlier, 0.1, MIXTURE);
        }
        assert!(
            (line.mean - SVector::from([2.0, -0.5])).amax() < 0.05,
            "{:?}",
            line.mean
        );
        let before = line.mean;
        line.take(&SVector::from([1.0, 1.0]), f64::NAN, 0.1, MIXTURE);
        assert_eq!(before, line.mean);
    }
}
