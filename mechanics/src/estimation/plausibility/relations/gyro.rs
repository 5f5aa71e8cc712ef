//! The angular velocity about x and y, smoothed like the predicted lean.

use nalgebra::Vector2;

use super::lean_model::SMOOTHED_S;
use super::low_pass::{LowPass, share};

/// Weight of a sample in the noise of the gyro.
const NOISE_WEIGHT: f64 = 1.0 / 64.0;

/// The angular velocity, and its noise.
#[derive(Debug, Clone)]
pub(super) struct Gyro {
    smoothed: [LowPass<2>; 2],
    last: Option<Vector2<f64>>,
    /// Variance of a sample ((rad/s)^2).
    pub(super) noise: f64,
    /// Time between samples (s).
    pub(super) step_s: f64,
}

impl Gyro {
    pub(super) fn new() -> Self {
        Self {
            smoothed: [LowPass::new(SMOOTHED_S), LowPass::new(SMOOTHED_S)],
            last: None,
            noise: 0.0,
            step_s: 0.0,
        }
    }

    /// The smoothed angular velocity (rad/s) after a sample.
    pub(super) fn step(&mut self, dt: f64, turning: &Vector2<f64>) -> Vector2<f64> {
        if let Some(last) = self.last.replace(*turning) {
            // Neighbouring samples of a slow motion differ by noise: the variance of the difference is twice that.
            let noise = (turning - last).norm_squared() / 4.0;
            self.noise += NOISE_WEIGHT * (noise - self.noise);
            self.step_s += NOISE_WEIGHT * (dt - self.step_s);
        }
        let share = share(dt, SMOOTHED_S);
        let mut signal = *turning;
        for filter in &mut self.smoothed {
            signal = filter.step_by(share, &signal);
        }
        signal
    }
}
