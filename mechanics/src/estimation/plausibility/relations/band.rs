//! Band of a slow oscillation: two high-pass filters in a row.

use nalgebra::Vector2;

use super::low_pass::{LowPass, share};

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
}
