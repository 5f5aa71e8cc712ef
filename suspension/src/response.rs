//! Numbers in which the motion of one actuator needs fewer derivatives than that of all.

use tipwatch_mechanics::number::{Gradient, Real};

/// A number of a prospect, made of one, `A`, in which what a single actuator moves is computed.
pub(super) trait Among<A: Real>: Real {
    /// A number of an actuator among all.
    fn among(alone: A, actuator: usize) -> Self;
}

impl<T: Real> Among<T> for T {
    #[inline(always)]
    fn among(alone: Self, _: usize) -> Self {
        alone
    }
}

/// Of two variables, each is that of one actuator.
impl Among<Gradient<1>> for Gradient<2> {
    #[inline(always)]
    fn among(alone: Gradient<1>, actuator: usize) -> Self {
        let mut wider = Self::fixed(alone.value);
        wider.slopes[actuator] = alone.slopes[0];
        wider
    }
}
