//! How far a filter that knows only the past is behind a motion that changes fast.
//!
//! A filter of white jerk of spectral density q follows a motion of constant jerk J with the constant errors
//!
//! ```text
//!     e = J P[:, 2] / q,    the last of them J tau with tau = P[2][2] / q
//! ```
//! (In continuous time e solves (F - K H) e + g J = 0, with g = (0, 0, 1). By the Riccati equation of P, and as F' g = 0,
//! P g J / q does.) J tau is how far the acceleration changes within tau, so it is seen in the estimates themselves: as
//! the distance of the acceleration from its own mean over the last tau. White jerk of density q alone gives distances of
//! about P[2][2]; what is more is added to the covariance:
//!
//! ```text
//!     P + P[:, 2] P[2, :] (d^2 - P[2][2]) / P[2][2]^2
//! ```
//! A smoother also knows what comes after, and has no lag.

use super::white_jerk::{ChannelState, Matrix, symmetric};

/// Accelerations of the channels that count, averaged over the filter's own delay.
#[derive(Debug, Clone)]
pub(super) struct Lag {
    mean_accelerations: Vec<f64>,
    /// By channel: whether its motion says how far the estimates are behind.
    counts: Vec<bool>,
    largest_distance: f64,
}

impl Lag {
    pub(super) fn new(counts: Vec<bool>) -> Self {
        Self {
            mean_accelerations: vec![0.0; counts.len()],
            counts,
            largest_distance: 0.0,
        }
    }

    /// The filter started anew.
    pub(super) fn restart(&mut self) {
        self.mean_accelerations.fill(0.0);
        self.largest_distance = 0.0;
    }

    /// Takes the estimates `dt` seconds after the ones before, with their covariance and the density of the jerk.
    pub(super) fn step(
        &mut self,
        jets: &[ChannelState],
        covariance: &Matrix,
        density: f64,
        dt: f64,
    ) {
        let delay_s = covariance[2][2] / density;
        let renewed = dt / (dt + delay_s);
        let mut largest = 0.0_f64;
        let means = self.mean_accelerations.iter_mut().zip(&self.counts);
        for ((mean, &counts), jet) in means.zip(jets) {
            *mean += renewed * (jet[2] - *mean);
            if counts {
                largest = largest.max((jet[2] - *mean).abs());
            }
        }
        self.largest_distance = largest;
    }

    /// The covariance with the lag in it.
    pub(super) fn widen(&self, p: &Matrix) -> Matrix {
        let variance = p[2][2];
        let excess = self.largest_distance * self.largest_distance - variance;
        if excess <= 0.0 || variance <= 0.0 {
            return *p;
        }
        let share = excess / (variance * variance);
        symmetric(|i, j| p[i][j] + share * p[i][2] * p[j][2])
    }
}

#[cfg(test)]
mod tests {
    use super::super::kalman_filter::{Doubt, FilterModel, KalmanFilter};
    use super::super::white_jerk::seconds;

    const DENSITY: f64 = 0.01;
    const STEP_NS: i64 = 10_000_000;

    fn filter() -> KalmanFilter {
        let model = FilterModel {
            value_variance: 1e-7,
            rate_variance: 1e-5,
            density: DENSITY,
            max_gap_ns: 250_000_000,
        };
        KalmanFilter::new(model, 1, false)
    }

    /// Follows a motion of constant jerk (1/s^3) for some seconds; the errors at the end, and the filter.
    fn followed(jerk: f64, has_rates: bool) -> ([f64; 3], KalmanFilter) {
        let mut filter = filter();
        let at = |t: f64| [jerk * t * t * t / 6.0, jerk * t * t / 2.0, jerk * t];
        let mut stamp_ns = 0;
        while seconds(stamp_ns) < 8.0 {
            stamp_ns += STEP_NS;
            let [value, rate, _] = at(seconds(stamp_ns));
            let rates = [rate];
            let rates = has_rates.then_some(&rates[..]);
            filter
                .push(stamp_ns, &[value], rates, Doubt::default())
                .unwrap();
        }
        let (truth, found) = (at(seconds(stamp_ns)), filter.at(0, stamp_ns));
        (std::array::from_fn(|i| truth[i] - found[i]), filter)
    }

    #[test]
    fn constant_jerk_is_followed_at_the_stated_distance_and_the_band_covers_it() {
        for has_rates in [false, true] {
            let jerk = 3.0;
            let (errors, filter) = followed(jerk, has_rates);
            let stamp_ns = filter.last_ns().unwrap();
            let p = filter.covariance_at(stamp_ns);
            let widened = filter.covariance_with_lag_at(stamp_ns);
            for i in 0..3 {
                // The equation is that of continuous time: it is coarse where the delay has few samples.
                let stated = jerk * p[i][2] / DENSITY;
                assert!((errors[i] / stated - 1.0).abs() < 0.4, "{i}: {errors:?}");
                let z = errors[i] / widened[i][i].sqrt();
                assert!((0.6..1.3).contains(&z), "{i}: {z}");
                assert!(errors[i] > 3.0 * p[i][i].sqrt());
            }
        }
    }

    #[test]
    fn a_motion_without_jerk_has_no_lag() {
        let (_, filter) = followed(0.0, true);
        let stamp_ns = filter.last_ns().unwrap();
        let p = filter.covariance_at(stamp_ns);
        assert_eq!(filter.covariance_with_lag_at(stamp_ns), p);
    }
}
