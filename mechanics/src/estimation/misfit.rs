//! Ratio of a filter's errors to those that its stated noise explains.
//!
//! An innovation nu has the variance S = h' P h + r by the stated noise. With the mean over the channels and the last
//! tenths of a second,
//!
//! ```text
//!     c = mean of nu^2 / S
//! ```
//! is 1 where the noise is as stated, and more where, for example, an engine shakes the sensor. The filter's gains stay:
//! those of the platform have to be alike (see [`Filters`](super::state_builder::Filters)). The covariance of its estimates
//! is c times the stated one, which is exact where process and measurement are both noisier by c, and too much where it
//! is the measurement alone: by h' Q h over S, as Q is what the process adds. Where c is less than 1, what was stated stays.

/// Memory (s): longer than half a sway of the platform, after which the squares repeat, and no longer than some delays of the filter: what
/// a knock has left in the estimates has gone by then.
pub(super) const MEMORY_S: f64 = 0.3;

/// The mean c of one filter.
#[derive(Debug, Clone)]
pub(super) struct Misfit {
    /// Weight of each channel: one if it counts, zero otherwise.
    counts: Vec<f64>,
    mean: f64,
    memory_s: f64,
}

/// Returns the weight of each channel: one if it counts, zero otherwise; if none counts, all do.
pub(super) fn weights(counts: impl Iterator<Item = bool>) -> Vec<f64> {
    let mut weights: Vec<f64> = counts.map(f64::from).collect();
    if weights.iter().all(|&weight| weight == 0.0) {
        weights.fill(1.0);
    }
    weights
}

impl Misfit {
    /// `counts`: which channels show the noise that the estimates of all of them depend on.
    pub(super) fn new(memory_s: f64, counts: impl Iterator<Item = bool>) -> Self {
        Self {
            counts: weights(counts),
            mean: 1.0,
            memory_s,
        }
    }

    /// A channel counts no more.
    pub(super) fn disregard(&mut self, channel: usize) {
        self.counts[channel] = 0.0;
        self.restart();
    }

    /// The filter started anew.
    pub(super) fn restart(&mut self) {
        self.mean = 1.0;
    }

    /// Takes nu^2 of each channel in a sample and their S, `dt` seconds after the one before.
    pub(super) fn step(&mut self, squares: impl Iterator<Item = f64>, variance: f64, dt: f64) {
        let counted = squares.zip(&self.counts);
        let size = counted.map(|(square, counts)| square * counts).sum::<f64>();
        let size = size / (self.counts.iter().sum::<f64>() * variance);
        if size.is_finite() {
            self.mean += dt / (dt + self.memory_s) * (size - self.mean);
        }
    }

    /// Factor on the stated covariance, at least 1.
    pub(super) fn factor(&self) -> f64 {
        self.mean.max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::kalman_filter::{Doubt, FilterModel, KalmanFilter};
    use super::super::white_jerk::seconds;

    const STEP_NS: i64 = 5_000_000;
    const STATED: FilterModel = FilterModel {
        value_variance: 0.05 * 0.05,
        rate_variance: 0.0,
        density: 30.0 * 30.0,
        max_gap_ns: 250_000_000,
    };

    /// Returns the rms error of the estimate of a constant by a shaken sensor, from the second second on: over its stated sigma,
    /// and over the sigma that the filter gives.
    fn shaken(amplitude: f64, hertz: f64) -> [f64; 2] {
        let mut filter = KalmanFilter::new(STATED, 1, false).weighing_misfit([true].into_iter());
        let (mut squares, mut samples) = ([0.0; 2], 0.0);
        for k in 0..1000 {
            let stamp_ns = k * STEP_NS;
            let angle = std::f64::consts::TAU * hertz * seconds(stamp_ns);
            let value = amplitude * angle.sin();
            (filter.push(stamp_ns, &[value], None, Doubt::default())).unwrap();
            if seconds(stamp_ns) > 1.0 {
                let error = filter.at(0, stamp_ns)[0];
                let given = filter.covariance_at(stamp_ns)[0][0];
                let stated = given / filter.misfit_factor();
                squares[0] += error * error / stated;
                squares[1] += error * error / given;
                samples += 1.0;
            }
        }
        squares.map(|sum: f64| (sum / samples).sqrt())
    }

    #[test]
    fn what_shakes_a_sensor_is_in_its_covariance() {
        for hertz in [23.0, 35.0, 58.0, 91.0] {
            let [stated, given] = shaken(4.0, hertz);
            assert!(stated > 10.0, "{hertz} Hz: {stated}");
            assert!((0.2..1.5).contains(&given), "{hertz} Hz: {given}");
        }
    }

    /// A wheel comes down: for a twentieth of a second the sensor is far from where the filter expects it.
    #[test]
    fn a_knock_is_forgotten_with_its_error() {
        let mut filter = KalmanFilter::new(STATED, 1, false).weighing_misfit([true].into_iter());
        for k in 0..600 {
            let value = if (200..210).contains(&k) { 5.0 } else { 0.0 };
            (filter.push(k * STEP_NS, &[value], None, Doubt::default())).unwrap();
            let factor = filter.misfit_factor();
            match k {
                210 => assert!(factor > 20.0, "{factor}"),
                // two seconds later
                599 => assert!(factor < 2.0, "{factor}"),
                _ => {}
            }
        }
    }

    #[test]
    fn noise_below_the_stated_one_changes_nothing() {
        let [stated, given] = shaken(0.03, 35.0);
        assert_eq!(stated, given);
    }
}
