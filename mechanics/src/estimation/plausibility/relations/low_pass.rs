//! Filters of a vector at irregular steps: a first-order low-pass filter, and the band of a slow oscillation.

use nalgebra::{SVector, Vector2};

/// Returns the share of a value that is left after decaying for `dt` seconds with this time constant.
pub(super) fn left(dt: f64, time_constant_s: f64) -> f64 {
    (-dt / time_constant_s).exp()
}

/// Returns the share of a step of the input that a low-pass filter with this time constant follows within `dt` seconds.
pub(super) fn share(dt: f64, time_constant_s: f64) -> f64 {
    1.0 - left(dt, time_constant_s)
}

/// Low-pass filter; it begins at its first input.
#[derive(Debug, Clone)]
pub(super) struct LowPass<const N: usize> {
    time_constant_s: f64,
    value: Option<SVector<f64, N>>,
}

impl<const N: usize> LowPass<N> {
    pub(super) fn new(time_constant_s: f64) -> Self {
        Self {
            time_constant_s,
            value: None,
        }
    }

    /// The output after an input that has lasted for `dt` seconds.
    ///
    /// ```text
    ///     y <- y + (1 - exp(-dt / T)) (x - y)
    /// ```
    pub(super) fn step(&mut self, dt: f64, input: &SVector<f64, N>) -> SVector<f64, N> {
        self.step_by(share(dt, self.time_constant_s), input)
    }

    /// Takes an input with the [`share`] of this step, and returns the filtered value: filters of one time constant share the
    /// exponential.
    pub(super) fn step_by(&mut self, share: f64, input: &SVector<f64, N>) -> SVector<f64, N> {
        let before = self.value.unwrap_or(*input);
        let next = before + (input - before) * share;
        self.value = Some(next);
        next
    }

    /// The last output; `None` before the first input.
    pub(super) fn value(&self) -> Option<SVector<f64, N>> {
        self.value
    }

    pub(super) fn reset(&mut self) {
        self.value = None;
    }
}

/// Two high-pass filters in a row.
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
