//! Numbers in which the motion of one actuator needs fewer derivatives than that of all.

use crate::number::{Dual, Real, SecondOrder};

/// A number of a prospect, and the smaller one in which what a single actuator moves is computed.
pub(super) trait Response: Real {
    /// What depends on one actuator alone.
    type Alone: Real;

    /// That of an actuator among all.
    fn among(alone: Self::Alone, actuator: usize) -> Self;
}

/// Numbers that are their own.
macro_rules! alone {
    ($number:ty) => {
        impl Response for $number {
            type Alone = Self;
            #[inline(always)]
            fn among(alone: Self, _: usize) -> Self {
                alone
            }
        }
    };
}

alone!(f64);
alone!(Dual<f64>);
alone!(SecondOrder<f64, 1>);

impl Response for SecondOrder<f64, 2> {
    type Alone = SecondOrder<f64, 1>;
    #[inline(always)]
    fn among(alone: SecondOrder<f64, 1>, actuator: usize) -> Self {
        alone.among_two(actuator)
    }
}
