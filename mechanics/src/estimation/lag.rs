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
//!     l = sign(d) sqrt(max(d^2, m) - P[2][2]),    e = P[:, 2] l / P[2][2]
//! ```
//! The estimates are late by tau themselves, and their mean by another tau: d shows the lag of 2 tau ago. In a motion that
//! swings fast, d is zero when the lag is large. Therefore m, the mean of d^2 over the last 2 tau: noise alone gives
//! no more than P[2][2] in it.
//!
//! Where samples are missing, the motion goes on with its jerk J = l q / P[2][2], which the estimates do not know. So t seconds after the
//! last sample, with P' of that time, the error is `F e + J (t^3/6, t^2/2, t) = P'[:, 2] l / P[2][2]`.
//!
//! Its sign is known: the lags of one motion in several channels add up or cancel in a load as they do in truth. A smoother
//! also knows what comes after, and has no lag.

use super::white_jerk::{ChannelState, Matrix};

/// Accelerations of the channels, averaged over the filter's own delay.
#[derive(Debug, Clone)]
pub(super) struct MeanAccelerations {
    by_channel: Vec<Mean>,
}

/// Those of one channel.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    acceleration: f64,
    /// Mean square of the distance from it.
    distance_squared: f64,
}

impl MeanAccelerations {
    pub(super) fn new(channels: usize) -> Self {
        Self {
            by_channel: vec![Mean::default(); channels],
        }
    }

    /// The filter started anew.
    pub(super) fn restart(&mut self) {
        self.by_channel.fill(Mean::default());
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
        let [renewed, of_distance] = [delay_s, 2.0 * delay_s].map(|memory_s| dt / (dt + memory_s));
        for (mean, jet) in self.by_channel.iter_mut().zip(jets) {
            mean.acceleration += renewed * (jet[2] - mean.acceleration);
            let distance = jet[2] - mean.acceleration;
            mean.distance_squared += of_distance * (distance * distance - mean.distance_squared);
        }
    }

    /// The lag e of a channel; zero within its noise. `p22` is the variance of the acceleration at the last sample, `ahead` the
    /// covariance at the time that is asked for.
    pub(super) fn lag(
        &self,
        channel: usize,
        acceleration: f64,
        p22: f64,
        ahead: &Matrix,
    ) -> ChannelState {
        let mean = &self.by_channel[channel];
        let distance = acceleration - mean.acceleration;
        let squared = (distance * distance).max(mean.distance_squared);
        let excess = (squared - p22).max(0.0);
        let lag = excess.sqrt().copysign(distance);
        match p22 > 0.0 {
            true => [0, 1, 2].map(|i| lag * (ahead[i][2] / p22)),
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

    /// Follows a motion of constant jerk (1/s^3) for some seconds; the errors so long after the last sample, and the filter.
    fn followed(jerk: f64, has_rates: bool, ahead_ns: i64) -> ([f64; 3], KalmanFilter) {
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
        let later_ns = stamp_ns + ahead_ns;
        let (truth, found) = (at(seconds(later_ns)), filter.at(0, later_ns));
        (std::array::from_fn(|i| truth[i] - found[i]), filter)
    }

    #[test]
    fn constant_jerk_is_followed_at_the_stated_distance_and_the_lag_is_that_distance() {
        for has_rates in [false, true] {
            let jerk = 3.0;
            let (errors, filter) = followed(jerk, has_rates, 0);
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
    fn where_samples_are_missing_the_lag_grows_as_the_error_does() {
        let ahead_ns = 200_000_000;
        let (errors, filter) = followed(3.0, false, ahead_ns);
        let last_ns = filter.last_ns().unwrap();
        let lag = filter.lag_at(0, last_ns + ahead_ns);
        for i in 0..3 {
            let found = errors[i] / lag[i];
            assert!((1.0..1.02).contains(&found), "{i}: {found}");
        }
        assert!(lag[2] > 2.0 * filter.lag_at(0, last_ns)[2]);
    }

    /// An arm swings: the lag is largest when the estimated acceleration equals its own mean.
    #[test]
    fn a_swing_stays_within_its_lag() {
        for times in [0.3, 0.5] {
            let mut filter = filter();
            let mut rest = 1..800;
            rest.try_for_each(|k| filter.push(k * STEP_NS, &[0.0], None, Doubt::default()))
                .unwrap();
            let delay_s = filter.covariance_at(799 * STEP_NS)[2][2] / DENSITY;
            let angular = times / delay_s;
            let (mut errors, mut within) = (0, 0);
            for k in 800..2400 {
                let (t, stamp_ns) = (seconds((k - 800) * STEP_NS), k * STEP_NS);
                let amplitude = (t / 4.0).min(1.0);
                let (sin, cos) = (angular * t).sin_cos();
                let value = [amplitude * sin];
                filter
                    .push(stamp_ns, &value, None, Doubt::default())
                    .unwrap();
                if t < 6.0 {
                    continue;
                }
                let truth = [sin, angular * cos, -angular * angular * sin];
                let (found, lag) = (filter.at(0, stamp_ns), filter.lag_at(0, stamp_ns));
                for i in 1..3 {
                    errors += 1;
                    within += i32::from((found[i] - truth[i]).abs() < 2.0 * lag[i].abs());
                }
            }
            let share = f64::from(within) / f64::from(errors);
            assert!(share > 0.95, "{times}: {share}");
        }
    }

    #[test]
    fn a_motion_without_jerk_has_no_lag() {
        let (_, filter) = followed(0.0, true, 0);
        let stamp_ns = filter.last_ns().unwrap();
        assert_eq!(filter.lag_at(0, stamp_ns), [0.0; 3]);
    }
}
