//! Linear regression with normally distributed amounts and errors: marginal likelihood and posterior in closed form.
//!
//! ```text
//!     y = S theta + e,   theta ~ N(0, diag(sigma^2)),   e ~ N(0, C),   K = C + S diag(sigma^2) S'
//!     ln p(y) = -(y' K^-1 y + ln det K + n ln 2 pi) / 2
//!     theta | y ~ N(P S' K^-1 y, P - P S' K^-1 S P),   P = diag(sigma^2)
//! ```

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Result of a regression.
#[derive(Debug, Clone)]
pub(super) struct Posterior {
    /// Logarithm of the marginal likelihood.
    pub(super) log_evidence: f64,
    /// The amounts, in their units.
    pub(super) mean: DVector<f64>,
    /// Covariance of the amounts.
    pub(super) covariance: DMatrix<f64>,
}

impl Posterior {
    /// Returns the squared Mahalanobis distance of amounts from the most probable ones; `None` if the covariance is not positive
    /// definite.
    pub(super) fn apart(&self, amounts: &DVector<f64>) -> Option<f64> {
        if amounts.is_empty() {
            return Some(0.0);
        }
        let off = amounts - &self.mean;
        Some(off.dot(&factor(self.covariance.clone())?.solve(&off)))
    }
}

/// Solves the regression; `None` if a number is not finite or the covariance is not positive.
pub(super) fn regress(
    y: &DVector<f64>,
    derivatives: &DMatrix<f64>,
    sigmas: &[f64],
    errors: &DMatrix<f64>,
) -> Option<Posterior> {
    let mut scaled = derivatives.clone();
    for (mut column, sigma) in scaled.column_iter_mut().zip(sigmas) {
        column *= *sigma;
    }
    let whole = errors + &scaled * scaled.transpose();
    let factor = factor(whole)?;
    let weighed = factor.solve(y);
    let log_determinant = 2.0 * factor.l_dirty().diagonal().map(f64::ln).sum();
    let n = y.len() as f64;
    let squares = y.dot(&weighed);
    let log_evidence = -0.5 * (squares + log_determinant + n * std::f64::consts::TAU.ln());
    let mut mean = scaled.transpose() * weighed;
    let mut covariance =
        DMatrix::identity(sigmas.len(), sigmas.len()) - scaled.transpose() * factor.solve(&scaled);
    for (i, sigma) in sigmas.iter().enumerate() {
        mean[i] *= *sigma;
        covariance.row_mut(i).scale_mut(*sigma);
        covariance.column_mut(i).scale_mut(*sigma);
    }
    log_evidence.is_finite().then_some(Posterior {
        log_evidence,
        mean,
        covariance,
    })
}

/// Mean of several posteriors, each with the weight of its evidence.
pub(super) fn mixed(posteriors: &[Posterior]) -> Option<Posterior> {
    let logs = posteriors.iter().map(|posterior| posterior.log_evidence);
    let largest = logs.reduce(f64::max)?;
    let weight = |posterior: &Posterior| (posterior.log_evidence - largest).exp();
    let total: f64 = posteriors.iter().map(weight).sum();
    let size = posteriors[0].mean.len();
    let mut mean = DVector::zeros(size);
    for posterior in posteriors {
        mean += &posterior.mean * (weight(posterior) / total);
    }
    let mut covariance = DMatrix::zeros(size, size);
    for posterior in posteriors {
        let off = &posterior.mean - &mean;
        covariance +=
            (&posterior.covariance + &off * off.transpose()) * (weight(posterior) / total);
    }
    Some(Posterior {
        log_evidence: largest + (total / posteriors.len() as f64).ln(),
        mean,
        covariance,
    })
}

/// Cholesky factor of a covariance; `None` if it has none.
pub(super) fn factor(covariance: DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    let is_known = covariance.iter().all(|value| value.is_finite());
    is_known.then(|| covariance.cholesky()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two measurements of one amount with unit noise, amount of prior sigma 2: in closed form.
    #[test]
    fn evidence_and_posterior_have_their_closed_form() {
        let y = DVector::from_vec(vec![1.0, 3.0]);
        let s = DMatrix::from_element(2, 1, 1.0);
        let found = regress(&y, &s, &[2.0], &DMatrix::identity(2, 2)).unwrap();
        // precision 1/4 + 2
        assert!((found.mean[0] - 4.0 / 2.25).abs() < 1e-12);
        assert!((found.covariance[(0, 0)] - 1.0 / 2.25).abs() < 1e-12);
        // K = [[5, 4], [4, 5]]: determinant 9, y' K^-1 y = (5 + 45 - 24) / 9
        let tau = std::f64::consts::TAU;
        let expected = -0.5 * (26.0 / 9.0 + 9_f64.ln() + 2.0 * tau.ln());
        assert!((found.log_evidence - expected).abs() < 1e-12);
    }

    #[test]
    fn an_amount_that_is_not_needed_counts_against_an_explanation() {
        let y = DVector::from_vec(vec![0.1, -0.2, 0.05]);
        let s = DMatrix::from_element(3, 1, 1.0);
        let errors = DMatrix::identity(3, 3);
        let none = regress(&y, &DMatrix::zeros(3, 0), &[], &errors).unwrap();
        let one = regress(&y, &s, &[30.0], &errors).unwrap();
        assert!(none.log_evidence > one.log_evidence + 2.0);
    }

    #[test]
    fn a_mixture_contains_the_spread_of_its_parts() {
        let part = |mean: f64| Posterior {
            log_evidence: -1.0,
            mean: DVector::from_vec(vec![mean]),
            covariance: DMatrix::from_element(1, 1, 1.0),
        };
        let both = mixed(&[part(0.0), part(4.0)]).unwrap();
        assert!((both.mean[0] - 2.0).abs() < 1e-12);
        assert!((both.covariance[(0, 0)] - 5.0).abs() < 1e-12);
        assert!(mixed(&[]).is_none());
    }

    #[test]
    fn unknown_numbers_have_no_evidence() {
        let y = DVector::from_vec(vec![f64::NAN]);
        let s = DMatrix::zeros(1, 0);
        assert!(regress(&y, &s, &[], &DMatrix::identity(1, 1)).is_none());
        let errors = DMatrix::from_element(1, 1, -1.0);
        assert!(regress(&DVector::zeros(1), &s, &[], &errors).is_none());
    }
}
