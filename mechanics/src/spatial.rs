//! Force and moment together.

use nalgebra::Vector3;

use crate::number::Real;

/// A force and the moment about a stated point, in stated axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrench<T> {
    /// Force [N].
    pub force: Vector3<T>,
    /// Moment [N m].
    pub moment: Vector3<T>,
}

impl<T: Real> Wrench<T> {
    /// No force, no moment.
    #[must_use]
    pub fn zero() -> Self {
        Self { force: Vector3::zeros(), moment: Vector3::zeros() }
    }

    /// The sum of two wrenches about the same point.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self { force: self.force + other.force, moment: self.moment + other.moment }
    }

    /// The difference of two wrenches about the same point.
    #[must_use]
    pub fn minus(&self, other: &Self) -> Self {
        Self { force: self.force - other.force, moment: self.moment - other.moment }
    }

    /// The same wrench with the moment about `point`, given from the present one.
    #[must_use]
    pub fn about(&self, point: &Vector3<T>) -> Self {
        Self { force: self.force, moment: self.moment - point.cross(&self.force) }
    }
}
