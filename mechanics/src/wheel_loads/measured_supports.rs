//! Whether the measured loads of all supports are followed, and how uncertain they are.

use crate::machine::MAX_WHEELS;
use crate::number::{Mask, Real};

/// The measured loads of all supports on the ground.
#[derive(Debug)]
pub(super) struct MeasuredSupports<T> {
    /// 1 where they are followed, else 0.
    pub(super) follows: T,
    /// Variance of each (N^2).
    pub(super) variance: [T; MAX_WHEELS],
}

impl<T: Real> MeasuredSupports<T> {
    pub(super) fn nowhere() -> Self {
        Self {
            follows: T::zero(),
            variance: [T::zero(); MAX_WHEELS],
        }
    }

    /// Where they are followed.
    pub(super) fn follows(&self) -> T::Mask {
        T::zero().lt(self.follows)
    }

    /// Whether they are followed in any sample.
    pub(super) fn follows_any(&self) -> bool {
        self.follows().any()
    }

    /// These variances of loads, or those of the measured loads where they are followed.
    pub(super) fn or_measured(&self, mut variances: [T; MAX_WHEELS]) -> [T; MAX_WHEELS] {
        for (variance, measured) in variances.iter_mut().zip(&self.variance) {
            *variance = T::select(self.follows(), *measured, *variance);
        }
        variances
    }

    /// Variance of a weighted sum of the loads, where they are followed (N^2).
    pub(super) fn variance_of(&self, factors: &[T]) -> T {
        let pairs = factors.iter().zip(&self.variance);
        pairs.fold(T::zero(), |sum, (&factor, &variance)| {
            sum + factor * factor * variance
        })
    }
}
