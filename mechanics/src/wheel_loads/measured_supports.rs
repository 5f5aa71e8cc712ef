//! Measured loads of all supports that the computed loads follow, and their variances.

use crate::machine::MAX_WHEELS;
use crate::number::{Mask, Real};

/// The measured loads of all supports on the ground.
#[derive(Debug)]
pub(super) struct MeasuredSupports<T> {
    /// 1 where the computed loads follow them, else 0.
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

    /// Returns the samples in which the computed loads follow the measured ones.
    pub(super) fn follows(&self) -> T::Mask {
        T::zero().lt(self.follows)
    }

    /// Whether the computed loads follow the measured ones in any sample.
    pub(super) fn follows_any(&self) -> bool {
        self.follows().any()
    }

    /// Returns these variances of loads, or those of the measured loads where the computed loads follow them.
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
