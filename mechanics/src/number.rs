//! The number type of the equations: `f64` for one sample, [`Lanes`] for four samples at once, dual numbers
//! for derivatives. One set of equations serves all of them.
//!
//! Operations are restricted to those that IEEE 754 defines exactly (add, subtract, multiply, divide,
//! square root, compare): no fused multiply-add, no platform `sin`. Every lane of a [`Lanes`] therefore
//! holds the same bits as a scalar `f64` evaluation.

mod atan2;
mod dual;
mod gradient;
mod jet;
mod lanes;
mod sin_cos;

pub use dual::Dual;
pub use gradient::Gradient;
pub use jet::Jet;
pub use lanes::{LaneMask, Lanes};

use std::fmt::Debug;
use std::ops::{
    Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign,
};

use num_traits::{One, Zero};

/// The result of a comparison: one truth value for each sample that a [`Real`] holds.
pub trait Mask:
    Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// The same truth value for every sample.
    fn splat(value: bool) -> Self;
    /// Whether the value of any sample is true.
    fn any(self) -> bool;
}

/// A number type of the mechanics, see the [module](self).
pub trait Real:
    Copy
    + Debug
    + PartialEq
    + Send
    + Sync
    + 'static
    + Zero
    + One
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
{
    /// Result type of comparisons.
    type Mask: Mask;

    /// The constant `value` for every sample.
    fn constant(value: f64) -> Self;

    /// This number times a constant: `self * Self::constant(factor)`, cheaper for types that carry
    /// derivatives.
    #[inline(always)]
    #[must_use]
    fn scaled(self, factor: f64) -> Self {
        self * Self::constant(factor)
    }

    /// Square root; NaN below zero.
    fn sqrt(self) -> Self;

    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);

    /// Angle of the direction (x, self) from the x axis (rad), -pi to pi; 0 for (0, 0), NaN if either is NaN.
    fn atan2(self, x: Self) -> Self;

    /// `self < other`; false if either is NaN.
    fn lt(self, other: Self) -> Self::Mask;

    /// `if_true` where `mask` is true, `if_false` elsewhere.
    fn select(mask: Self::Mask, if_true: Self, if_false: Self) -> Self;

    /// The same value as a constant, with zero derivatives.
    #[must_use]
    fn held(self) -> Self {
        self
    }

    /// The smaller of the two; `other` if either is NaN.
    fn min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }

    /// The larger of the two; `other` if either is NaN.
    fn max(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }

    /// Absolute value.
    fn abs(self) -> Self {
        Self::select(self.lt(Self::zero()), -self, self)
    }
}

impl Mask for bool {
    fn splat(value: bool) -> Self {
        value
    }

    fn any(self) -> bool {
        self
    }
}

impl Real for f64 {
    type Mask = bool;

    #[inline]
    fn constant(value: f64) -> Self {
        value
    }

    #[inline]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
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
    fn lt(self, other: Self) -> bool {
        self < other
    }

    #[inline]
    fn select(mask: bool, if_true: Self, if_false: Self) -> Self {
        if mask { if_true } else { if_false }
    }
}
