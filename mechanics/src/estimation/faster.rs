//! A faster filter beside that of the platform's motion, for motion that is too fast for it.
//!
//! A filter lets motion up to about w0 = (q / r)^(1/6) pass, with r the variance of the measurement per second, for what
//! shakes the sensor alone must not. After a landing or a blow it is late, and then swings past: for several samples its
//! estimate is wrong by what it still holds of the blow. A second filter of the same samples, b times as fast (its process
//! noise is b^6 q), shows that as the distance d between both. It is more than noise where
//!
//! ```text
//!     D = mean over the channels of the platform of d_i^2 / P_i,    s = max(0, 1 - D0 / D)
//! ```
//! exceeds D0, with P the covariance of the faster filter, as large as its own innovations show it to be: what shakes faster
//! than it follows, such as an engine, is in P and not in d. By the positive-part estimator of James and Stein the estimate
//! is the share s of the way from the slow filter to the fast one: by less than noise, nothing. That the truth may be with
//! either has the variance s (1 - s) d^2, as an error of known sign like the [`lag`](super::lag).
//!
//! All channels of the platform have the same share, because the force at the centre of mass follows from specific force,
//! angular velocity and its derivative together: if one of them were followed faster than the others, what the tyres shake
//! would no longer cancel.

use super::white_jerk::{Channel, Matrix, symmetric};

/// Ratio b of the bandwidths of the faster filter and of the platform's: the latter passes 3 Hz by default, a landing on stiff
/// tyres has 5 Hz, and engines shake at 20 Hz and more.
pub(super) const RATIO: f64 = 4.0;
/// Memory of the faster filter's innovations (s), some of its own delays: vibration that begins shows as noise at once.
pub(super) const MEMORY_S: f64 = 0.1;
/// D0. Noise alone gives 1, of which the channels are too few to be sure. On the calibration set, nothing is taken of it on
/// sound logs that drive on flat ground, shaken or not.
const LEAST_DISTANCE: f64 = 2.0;

/// The share s for so large a distance; zero where there is none.
pub(super) fn share(distance: f64) -> f64 {
    // written so that NaN is zero
    (1.0 - LEAST_DISTANCE / distance).max(0.0)
}

impl Channel {
    /// Returns the channel moved by a share of the way to the estimate of a faster filter.
    pub(super) fn towards(&self, faster: &Self, share: f64) -> Self {
        let spread = (share * (1.0 - share)).sqrt();
        let distance: [f64; 3] = std::array::from_fn(|i| faster.jet[i] - self.jet[i]);
        let between = |a: f64, b: f64| a + share * (b - a);
        Self {
            jet: std::array::from_fn(|i| self.jet[i] + share * distance[i]),
            lag: std::array::from_fn(|i| {
                between(self.lag[i], faster.lag[i]) + spread * distance[i]
            }),
        }
    }
}

/// The share of the way from one covariance to another.
pub(super) fn towards(from: &Matrix, to: &Matrix, share: f64) -> Matrix {
    symmetric(|i, j| from[i][j] + share * (to[i][j] - from[i][j]))
}

#[cfg(test)]
mod tests {
    use super::super::kalman_filter::{Doubt, FilterModel, KalmanFilter};
    use super::super::noise_of_tests::Noise;
    use super::super::white_jerk::{Channel, seconds};
    use super::share;

    const STEP_NS: i64 = 4_000_000;
    const NOISE: f64 = 0.05;
    const BEGIN_S: f64 = 2.0;
    /// The defaults of a specific force.
    const STATED: FilterModel = FilterModel {
        value_variance: NOISE * NOISE,
        rate_variance: 0.0,
        density: 30.0 * 30.0,
        max_gap_ns: 250_000_000,
    };

    /// As many as the platform has: three of the specific force, three of the angular velocity.
    const CHANNELS: usize = 6;

    /// An estimate: its time (s), the share of the faster filter in it, and the error and standard deviation of its first
    /// channel.
    struct Row {
        t: f64,
        share: f64,
        error: f64,
        sigma: f64,
    }

    /// Returns the rows of a filter whose first channel is to follow `truth`, while the sensor alone feels `shake`.
    fn rows(
        truth: impl Fn(f64) -> f64,
        shake: impl Fn(f64) -> f64,
        takes_of_faster: bool,
    ) -> Vec<Row> {
        let mut filter = KalmanFilter::new(STATED, CHANNELS, false)
            .weighing_misfit([true; CHANNELS].into_iter())
            .beside_faster();
        let mut noise = Noise(5);
        let rows = (0..1000).filter_map(|k| {
            let stamp_ns = k * STEP_NS;
            let t = seconds(stamp_ns);
            let mut values = [0.0; CHANNELS].map(|_| shake(t) + NOISE * noise.next());
            values[0] += truth(t);
            let pushed = filter.push(stamp_ns, &values, None, Doubt::default());
            pushed.unwrap();
            let share = match takes_of_faster {
                true => share(filter.distance_of_faster::<0>(stamp_ns).unwrap()),
                false => 0.0,
            };
            let mut channels = [Channel::default(); CHANNELS];
            let covariance = filter.read(stamp_ns, share, &mut channels);
            let Channel { jet, lag } = channels[0];
            let error = jet[0] - truth(t);
            let sigma = (covariance[0][0] + lag[0] * lag[0]).sqrt();
            (t > 1.0).then_some(Row {
                t,
                share,
                error,
                sigma,
            })
        });
        rows.collect()
    }

    /// Wheels land and the machine bounces on its tyres at 5 Hz.
    fn landing(t: f64) -> f64 {
        let s = (t - BEGIN_S).max(0.0);
        9.81 + 13.0 * (-4.0 * s).exp() * (31.0 * s).sin()
    }

    fn rms(values: impl Iterator<Item = f64>) -> f64 {
        let (sum, count) = values.fold((0.0_f64, 0.0), |(sum, n), x: f64| (sum + x * x, n + 1.0));
        (sum / count).sqrt()
    }

    #[test]
    fn the_estimate_after_a_landing_is_within_its_band() {
        let after = |row: &&Row| (BEGIN_S + 0.02..BEGIN_S + 0.5).contains(&row.t);
        let of = |takes: bool| {
            let rows = rows(landing, |_| 0.0, takes);
            let errors = rms(rows.iter().filter(after).map(|row| row.error));
            let normal = rms(rows.iter().filter(after).map(|row| row.error / row.sigma));
            (errors, normal)
        };
        let ((slow, beyond), (error, normal)) = (of(false), of(true));
        assert!(slow > 3.0 && beyond > 2.0, "{slow} {beyond}");
        assert!(error < 0.3 * slow, "{error} {slow}");
        assert!((0.3..1.5).contains(&normal), "{normal}");
    }

    #[test]
    fn nothing_is_taken_of_noise_nor_of_what_an_engine_shakes() {
        for (amplitude, hertz) in [(0.0, 0.0), (4.0, 23.0), (4.0, 35.0), (4.0, 58.0)] {
            let shake = |t: f64| amplitude * (std::f64::consts::TAU * hertz * t).sin();
            let rows = rows(|_| 9.81, shake, true);
            let most = rows.iter().map(|row| row.share).fold(0.0, f64::max);
            assert!(most < 0.4, "{hertz} Hz: {most}");
            let mean = rows.iter().map(|row| row.share).sum::<f64>() / rows.len() as f64;
            assert!(mean < 0.1, "{hertz} Hz: {mean}");
        }
    }

    #[test]
    fn what_begins_to_shake_the_sensor_is_in_the_band() {
        let shake = |t: f64| match t > BEGIN_S {
            true => 4.0 * (220.0 * t).sin(),
            false => 0.0,
        };
        let rows = rows(|_| 9.81, shake, true);
        let within = |from: f64, to: f64| {
            let inside = move |row: &&Row| (BEGIN_S + from..BEGIN_S + to).contains(&row.t);
            rms((rows.iter().filter(inside)).map(|row| row.error / row.sigma))
        };
        assert!(within(0.0, 0.1) < 3.0, "{}", within(0.0, 0.1));
        assert!(within(0.2, 0.5) < 2.0, "{}", within(0.2, 0.5));
    }
}
