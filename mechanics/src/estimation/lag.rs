//! Lag of a causal filter behind a motion that changes fast.
//!
//! A filter of white jerk of spectral density q follows a motion of constant jerk J with the constant errors
//!
//! ```text
//!     e = J P[:, 2] / q,    the last of them J tau with tau = P[2][2] / q
//! ```
//! (In continuous time e solves (F - K H) e + g J = 0, with g = (0, 0, 1). By the Riccati equation of P, and as F' g = 0,
//! P g J / q does.) J tau is how far the acceleration changes within tau, so it is seen in the estimates themselves: as
//! the distance of the acceleration from its own mean over the last tau. White jerk of density q alone gives distances of
//! about P[2][2]; what is more is lag:
//!
//! ```text
//!     l = sign(d) sqrt(d^2 - P[2][2]),    e = P[:, 2] l / P[2][2]
//! ```
//! Its sign is known: the lags of one motion in several channels add up or cancel in a load as they do in truth. A smoother
//! also knows what comes after, and has no lag.

use super::white_jerk::{ChannelState, Matrix};

/// Accelerations of the channels, averaged over the filter's own delay.
#[derive(Debug, Clone)]
pub(super) struct MeanAccelerations {
    by_channel: Vec<f64>,
}

impl MeanAccelerations {
    pub(super) fn new(channels: usize) -> Self {
        Self {
            by_channel: vec![0.0; channels],
        }
    }

    /// The filter started anew.
    pub(super) fn restart(&mut self) {
        self.by_channel.fill(0.0);
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
        for (mean, jet) in self.by_channel.iter_mut().zip(jets) {
            *mean += renewed * (jet[2] - *mean);
        }
    }

    /// The lag e of a channel; zero within its noise.
    pub(super) fn lag(&self, channel: usize, acceleration: f64, p: &Matrix) -> ChannelState {
        let distance = acceleration - self.by_channel[channel];
        let excess = (distance * distance - p[2][2]).max(0.0);
        let lag = excess.sqrt().copysign(distance);
        match p[2][2] > 0.0 {
            true => [0, 1, 2].map(|i| lag * (p[i][2] / p[2][2])),
            false => [0.0; 3],
        }
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
    fn constant_jerk_is_followed_at_the_stated_distance_and_the_lag_is_that_distance() {
        for has_rates in [false, true] {
            let jerk = 3.0;
            let (errors, filter) = followed(jerk, has_rates);
            let stamp_ns = filter.last_ns().unwrap();
            let p = filter.covariance_at(stamp_ns);
            let lag = filter.lag_at(0, stamp_ns);
            for i in 0..3 {
                let stated = jerk * p[i][2] / DENSITY;
                assert!((errors[i] / stated - 1.0).abs() < 1e-6, "{i}: {errors:?}");
                let found = errors[i] / lag[i];
                // less the part that is noise
                assert!((1.0..1.02).contains(&found), "{i}: {found}");
            }
            assert!(errors[2] > 3.0 * p[2][2].sqrt());
        }
    }

    #[test]
    fn a_motion_without_jerk_has_no_lag() {
        let (_, filter) = followed(0.0, true);
        let stamp_ns = filter.last_ns().unwrap();
        assert_eq!(filter.lag_at(0, stamp_ns), [0.0; 3]);
    }
}
