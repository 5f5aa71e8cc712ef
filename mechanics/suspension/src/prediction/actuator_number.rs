//! Number types that carry fewer derivatives for the motion of a single actuator than for all of them.

use tipwatch_mechanics::number::{Gradient, Real};

/// A number type for predictions, and the type `A` for bodies that a single actuator moves.
pub(crate) trait FromActuator<A: Real>: Real {
    /// Converts the number of one actuator.
    fn from_actuator(alone: A, actuator: usize) -> Self;
}

impl<T: Real> FromActuator<T> for T {
    #[inline(always)]
    fn from_actuator(alone: Self, _: usize) -> Self {
        alone
    }
}

/// With two variables, each belongs to one actuator.
impl FromActuator<Gradient<1>> for Gradient<2> {
    #[inline(always)]
    fn from_actuator(alone: Gradient<1>, actuator: usize) -> Self {
        let mut wider = Self::fixed(alone.value);
        wider.slopes[actuator] = alone.slopes[0];
        wider
    }
}
