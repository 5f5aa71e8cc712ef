//! Band of a slow oscillation: two high-pass filters in a row, and the lean of the platform in it by the gyro.

use nalgebra::Vector2;

use super::lean_model::SMOOTHED_S;
use super::low_pass::{LowPass, left, share};

/// Time over which the bias of the gyro is averaged at the start (s).
pub(super) const BIAS_S: f64 = 0.4;
/// Change of an angular velocity during that time from which the platform turns (rad/s), beside noise.
const TURNS: f64 = 3e-4;
/// Weight of a sample in the noise of the gyro.
const NOISE_WEIGHT: f64 = 1.0 / 64.0;

/// Two high-pass filters.
#[derive(Debug, Clone)]
pub(super) struct Band {
    time_constant_s: f64,
    filters: [LowPass<2>; 2],
}

impl Band {
    /// Filters with this time constant.
    pub(super) fn new(time_constant_s: f64) -> Self {
        Self {
            time_constant_s,
            filters: [LowPass::new(time_constant_s), LowPass::new(time_constant_s)],
        }
    }

    pub(super) fn step(&mut self, dt: f64, input: &Vector2<f64>) -> Vector2<f64> {
        let share = share(dt, self.time_constant_s);
        let mut signal = *input;
        for filter in &mut self.filters {
            signal -= filter.step_by(share, &signal);
        }
        signal
    }

    pub(super) fn reset(&mut self) {
        self.filters.iter_mut().for_each(LowPass::reset);
    }
}

/// Integral of the angular velocity in a band.
#[derive(Debug, Clone)]
pub(super) struct TurnedBand {
    time_constant_s: f64,
    /// Integral, high-passed (rad).
    turned: Vector2<f64>,
    slow: LowPass<2>,
}

impl TurnedBand {
    pub(super) fn new(time_constant_s: f64) -> Self {
        Self {
            time_constant_s,
            turned: Vector2::zeros(),
            slow: LowPass::new(time_constant_s),
        }
    }

    pub(super) fn step(&mut self, dt: f64, turning: &Vector2<f64>) -> Vector2<f64> {
        let left = left(dt, self.time_constant_s);
        self.turned = (self.turned + turning * dt) * left;
        self.turned - self.slow.step_by(1.0 - left, &self.turned)
    }

    pub(super) fn reset(&mut self) {
        self.turned = Vector2::zeros();
        self.slow.reset();
    }

    /// Variance of the angle due to noise of this variance in samples `dt` apart (rad^2).
    pub(super) fn variance(&self, noise: f64, dt: f64) -> f64 {
        noise * dt * self.time_constant_s / 2.0
    }
}

/// The angular velocity about x and y without bias, smoothed like the predicted lean.
#[derive(Debug, Clone)]
pub(super) struct Gyro {
    smoothed: [LowPass<2>; 2],
    last: Option<Vector2<f64>>,
    /// Variance of a sample ((rad/s)^2).
    pub(super) noise: f64,
    bias: Vector2<f64>,
    /// Means of the first and of the second half of the time for the bias, and their numbers of samples.
    halves: [(Vector2<f64>, f64); 2],
    known_s: f64,
}

impl Gyro {
    pub(super) fn new() -> Self {
        Self {
            smoothed: [LowPass::new(SMOOTHED_S), LowPass::new(SMOOTHED_S)],
            last: None,
            noise: 0.0,
            bias: Vector2::zeros(),
            halves: [(Vector2::zeros(), 0.0); 2],
            known_s: 0.0,
        }
    }

    /// The angular velocity (rad/s), once the bias is known.
    pub(super) fn step(&mut self, dt: f64, turning: &Vector2<f64>) -> Option<Vector2<f64>> {
        if let Some(last) = self.last.replace(*turning) {
            // Neighbouring samples of a slow motion differ by noise: the variance of the difference is twice that.
            let noise = (turning - last).norm_squared() / 4.0;
            self.noise += NOISE_WEIGHT * (noise - self.noise);
        }
        self.known_s += dt;
        if self.known_s <= BIAS_S {
            let (mean, count) = &mut self.halves[usize::from(self.known_s > BIAS_S / 2.0)];
            *count += 1.0;
            *mean += (turning - *mean) / *count;
            let [(a, m), (b, n)] = self.halves;
            self.bias = (a * m + b * n) / (m + n);
            return None;
        }
        let share = share(dt, SMOOTHED_S);
        let mut signal = turning - self.bias;
        for filter in &mut self.smoothed {
            signal = filter.step_by(share, &signal);
        }
        Some(signal)
    }

    /// Time since the bias was known (s).
    pub(super) fn known_s(&self) -> f64 {
        self.known_s - BIAS_S
    }

    /// Whether the platform turned while the bias was averaged, which then contains some of that.
    pub(super) fn turned_at_start(&self) -> bool {
        let [(a, m), (b, n)] = self.halves;
        let noise = (self.noise * (1.0 / m + 1.0 / n)).sqrt();
        // Written so that too few samples count as turning.
        !((a - b).amax() < TURNS + 3.0 * noise)
    }
}
