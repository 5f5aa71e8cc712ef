//! Division of the difference between accelerometer and attitude between the two.
//!
//! ```text
//!     s = b + e,   b ~ N(0, B),  e ~ N(0, E),  measured with covariance S
//!     b = B Q s,   cov b = B - B Q B,   Q = inv(B + E + S)
//! ```
//! E is that of a tilt across the up direction, and that of gravity along it. The data determine the sum
//! alone; its division rests on the stated standard deviations.
//!
//! Most attitudes are levelled by the accelerometer itself. They have its bias, and s is small across up
//! however large the bias is. The share w of the reduction of cov b across up is the probability that the two
//! are independent, both cases being equally likely beforehand:
//!
//! ```text
//!     w = p1 / (p0 + p1),  p_i = exp(-s's / 2 v_i) / v_i,  v0 = levelled^2 + S,  v1 = B + E + S
//! ```

use nalgebra::{Cholesky, Matrix3, Vector3};

use super::difference_filter::Difference;
use crate::state::AccelerometerBias;

/// A larger difference, in standard deviations, shows that one of the sensors is worse than stated. E is enlarged until the
/// difference has this size, so that the accelerometer is corrected as if the attitude, gravity or its own scale were to
/// blame; what is unexplained widens its variance, in proportion to the probability B / (B + E) that it is to blame itself.
const LARGEST_SIGMAS: f64 = 1.75;
/// Deviation (m/s^2) of the gravity direction by an attitude from that by the accelerometer which levels it. Such an attitude has
/// the bias of the accelerometer itself, so a small difference does not show that the bias is small.
const LEVELLED: f64 = 0.003;

/// Stated standard deviations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stated {
    /// Bias of the accelerometer, along each axis (m/s^2).
    pub(super) bias: f64,
    /// Horizontal part of gravity in the axes of a wrong attitude (m/s^2).
    pub(super) tilt: f64,
    /// Gravity (m/s^2).
    pub(super) gravity: f64,
}

/// The bias in a difference; `up` is a unit vector.
pub(super) fn divided(
    difference: &Difference,
    up: &Vector3<f64>,
    stated: &Stated,
) -> AccelerometerBias<f64> {
    let Difference {
        value: s,
        covariance,
    } = difference;
    let along = s.dot(up);
    let across = (s - up * along).norm();
    let along_noise = up.dot(&(covariance * up));
    let across_noise = 0.5 * (covariance.trace() - along_noise);
    let enlarged = |size: f64, stated_error: f64, noise: f64| {
        let own = stated_error * stated_error;
        let expected = stated.bias * stated.bias + own + noise;
        own + ((size / LARGEST_SIGMAS).powi(2) - expected).max(0.0)
    };
    let (tilt, gravity) = (
        enlarged(across, stated.tilt, across_noise),
        enlarged(along, stated.gravity, along_noise),
    );
    let b = stated.bias * stated.bias;
    let unexplained = |size: f64, stated_error: f64, noise: f64| {
        let own = stated_error * stated_error;
        let beyond = size.abs() - LARGEST_SIGMAS * (b + own + noise).sqrt();
        b / (b + own) * beyond.max(0.0).powi(2)
    };
    let aside = (s - up * along).try_normalize(0.0).unwrap_or_default();
    let open = aside * aside.transpose() * unexplained(across, stated.tilt, across_noise)
        + up * up.transpose() * unexplained(along, stated.gravity, along_noise);
    let sum =
        covariance + Matrix3::identity() * (b + tilt) + up * up.transpose() * (gravity - tilt);
    let Some(factor) = Cholesky::new(sum) else {
        return AccelerometerBias::unknown();
    };
    let q = factor.inverse();
    let independent = independence(
        across * across,
        LEVELLED * LEVELLED + across_noise,
        b + tilt + across_noise,
    );
    let upwards = up * up.transpose();
    let kept = (Matrix3::identity() - upwards) * independent.sqrt() + upwards;
    let change = kept * q * kept * (-b * b) + open;
    AccelerometerBias {
        removed: q * s * b,
        covariance_change: [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
            .map(|place| change[place]),
    }
}

/// Linear interpolation.
pub(super) fn between(
    a: &AccelerometerBias<f64>,
    b: &AccelerometerBias<f64>,
    share: f64,
) -> AccelerometerBias<f64> {
    AccelerometerBias {
        removed: a.removed + (b.removed - a.removed) * share,
        covariance_change: std::array::from_fn(|i| {
            let (from, to) = (a.covariance_change[i], b.covariance_change[i]);
            from + share * (to - from)
        }),
    }
}

/// Probability that attitude and accelerometer are independent, from the squared length of their difference across
/// up and its variance on each axis if the attitude is levelled by the accelerometer, and if not.
fn independence(squared: f64, levelled: f64, independent: f64) -> f64 {
    let exponent = 0.5 * squared * (1.0 / levelled - 1.0 / independent);
    let odds = independent / levelled * libm::exp(-exponent);
    1.0 / (1.0 + odds)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATED: Stated = Stated {
        bias: 0.03,
        tilt: 0.04,
        gravity: 0.01,
    };

    fn estimate(s: [f64; 3], noise: f64) -> AccelerometerBias<f64> {
        let difference = Difference {
            value: Vector3::from(s),
            covariance: Matrix3::identity() * noise * noise,
        };
        divided(&difference, &Vector3::z(), &STATED)
    }

    #[test]
    fn difference_is_divided_by_the_stated_variances() {
        let found = estimate([0.05, 0.0, 0.02], 0.0);
        assert!((found.removed.x - 0.05 * 0.36).abs() < 1e-12, "{found:?}");
        assert!((found.removed.z - 0.02 * 0.9).abs() < 1e-12, "{found:?}");
        let [xx, _, zz, ..] = found.covariance_change;
        assert!((xx + 0.0009 * 0.36).abs() < 1e-9 && (zz + 0.0009 * 0.9).abs() < 1e-12);
    }

    #[test]
    fn attitude_that_agrees_may_share_the_bias() {
        let [xx, yy, zz, ..] = estimate([0.0, 0.0, 0.0], 0.002).covariance_change;
        assert!(
            xx.abs() < 0.02 * 0.0009 && yy.abs() < 0.02 * 0.0009,
            "{xx} {yy}"
        );
        assert!(zz < -0.8 * 0.0009, "gravity cannot share it: {zz}");
    }

    #[test]
    fn unmeasured_difference_changes_nothing() {
        let found = estimate([0.05, 0.0, 0.02], 1e3);
        assert!(found.removed.norm() < 1e-9 && found.covariance_change[0].abs() < 1e-9);
    }

    #[test]
    fn difference_that_nothing_explains_is_in_the_band() {
        for (s, place) in [([1.0, 0.0, 0.0], 0), ([0.0, 0.0, -0.8], 2)] {
            let sigma = estimate(s, 0.01).covariance_change[place].sqrt();
            let size = Vector3::from(s).norm();
            assert!((0.4 * size..size).contains(&sigma), "{s:?}: {sigma}");
        }
        let explained = estimate([0.06, 0.0, 0.0], 0.01).covariance_change;
        assert!(
            explained.iter().all(|&change| change <= 0.0),
            "{explained:?}"
        );
    }

    #[test]
    fn gross_difference_is_left_for_the_plausibility_checks() {
        // Units of g, a sensor mounted askew: no bias explains them.
        for s in [[0.0, 0.0, -8.8], [5.0, 0.0, -1.4]] {
            assert!(estimate(s, 0.001).removed.norm() < 0.01);
        }
        // The correction is largest where the difference is just credible.
        let largest = (1..200)
            .map(|k| estimate([0.01 * f64::from(k), 0.0, 0.0], 0.0).removed.x)
            .fold(0.0, f64::max);
        assert!(largest < 2.0 * STATED.bias, "{largest}");
    }
}
