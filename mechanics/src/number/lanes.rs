//! Four samples in one vector register.

use std::ops::{
    Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign,
};

use num_traits::{One, Zero};
use wide::f64x4;

use super::real::{Mask, Real};
use super::{atan2, sin_cos};

/// Four `f64`, one per sample. Every lane holds the same bits as a scalar `f64` evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lanes(f64x4);

impl Lanes {
    /// Number of samples evaluated at once.
    pub const COUNT: usize = 4;

    /// Lanes from their values, in sample order.
    #[inline]
    #[must_use]
    pub fn from_array(values: [f64; Self::COUNT]) -> Self {
        Self(f64x4::new(values))
    }

    /// The values of the lanes, in sample order.
    #[inline]
    #[must_use]
    pub fn to_array(self) -> [f64; Self::COUNT] {
        self.0.to_array()
    }
}

/// Result of a comparison of [`Lanes`]: in each lane either all bits are set or no bit is.
#[derive(Debug, Clone, Copy)]
pub struct LaneMask(f64x4);

impl BitAnd for LaneMask {
    type Output = Self;
    #[inline]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for LaneMask {
    type Output = Self;
    #[inline]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for LaneMask {
    type Output = Self;
    #[inline]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl Mask for LaneMask {
    #[inline]
    fn splat(value: bool) -> Self {
        Self(f64x4::splat(if value {
            f64::from_bits(u64::MAX)
        } else {
            0.0
        }))
    }

    #[inline]
    fn any(self) -> bool {
        self.0.any()
    }
}

/// `Lanes op Lanes` and `Lanes op= Lanes`, lane by lane.
macro_rules! lane_wise {
    ($operation:ident, $method:ident, $assign:ident, $assign_method:ident) => {
        impl $operation for Lanes {
            type Output = Self;
            #[inline]
            fn $method(self, other: Self) -> Self {
                Self($operation::$method(self.0, other.0))
            }
        }

        impl $assign for Lanes {
            #[inline]
            fn $assign_method(&mut self, other: Self) {
                self.0 = $operation::$method(self.0, other.0);
            }
        }
    };
}

lane_wise!(Add, add, AddAssign, add_assign);
lane_wise!(Sub, sub, SubAssign, sub_assign);
lane_wise!(Mul, mul, MulAssign, mul_assign);
lane_wise!(Div, div, DivAssign, div_assign);

impl Neg for Lanes {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Zero for Lanes {
    #[inline]
    fn zero() -> Self {
        Self(f64x4::ZERO)
    }

    fn is_zero(&self) -> bool {
        *self == Self::zero()
    }
}

impl One for Lanes {
    #[inline]
    fn one() -> Self {
        Self(f64x4::ONE)
    }
}

impl Real for Lanes {
    type Mask = LaneMask;
    type Wheels = Self;

    #[inline]
    fn constant(value: f64) -> Self {
        Self(f64x4::splat(value))
    }

    #[inline]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }

    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        sin_cos::sin_cos(self)
    }

    #[inline]
    fn atan2(self, x: Self) -> Self {
        atan2::atan2(self, x)
    }

    #[inline]
    fn lt(self, other: Self) -> LaneMask {
        LaneMask(self.0.simd_lt(other.0))
    }

    #[inline]
    fn select(mask: LaneMask, if_true: Self, if_false: Self) -> Self {
        Self(mask.0.select(if_true.0, if_false.0))
    }
}
