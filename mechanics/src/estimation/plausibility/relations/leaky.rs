//! Integral of a rate that slowly forgets: the change over the last seconds.

use nalgebra::SVector;

/// The integral x of `dx/dt = r - x / T`.
#[derive(Debug, Clone)]
pub(super) struct LeakyIntegral<const N: usize> {
    pub(super) value: SVector<f64, N>,
}

impl<const N: usize> LeakyIntegral<N> {
    pub(super) fn new() -> Self {
        Self {
            value: SVector::zeros(),
        }
    }

    /// Adds the change of a step; `left`: see [`left`](super::low_pass::left). Integrals of one time constant share the
    /// exponential.
    pub(super) fn add(&mut self, left: f64, change: &SVector<f64, N>) {
        self.value = (self.value + change) * left;
    }
}
