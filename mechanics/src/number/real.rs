//! The operations that the equations need of a number.

use std::fmt::Debug;
use std::ops::{
    Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign,
};

use num_traits::{One, Zero};

/// The result of a comparison: one truth value for each sample that a [`Real`] holds.
pub trait Mask:
    Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// Returns one truth value for every sample.
    fn splat(value: bool) -> Self;
    /// Whether the value of any sample is true.
    fn any(self) -> bool;
}

/// Numbers of several wheels at the same instant, side by side. What is derived wheel by wheel with the same
/// operations gives the same bits.
pub trait Wheels<T: Real>: Real {
    /// Number of wheels held.
    const COUNT: usize;

    /// Returns one number for every wheel.
    fn each(number: T) -> Self;

    /// Returns the numbers by place.
    fn from_fn(number: impl Fn(usize) -> T) -> Self;

    /// Returns the numbers of consecutive wheels; zero where there are fewer than [`Self::COUNT`].
    fn of(numbers: &[T]) -> Self;

    /// Returns the number of one wheel.
    fn wheel(self, place: usize) -> T;
}

/// One wheel at a time.
impl<T: Real> Wheels<T> for T {
    const COUNT: usize = 1;

    #[inline(always)]
    fn each(number: T) -> Self {
        number
    }

    #[inline(always)]
    fn from_fn(number: impl Fn(usize) -> T) -> Self {
        number(0)
    }

    #[inline(always)]
    fn of(numbers: &[T]) -> Self {
        numbers.first().copied().unwrap_or(T::zero())
    }

    #[inline(always)]
    fn wheel(self, _: usize) -> T {
        self
    }
}

/// A number type of the mechanics, see the [module](super).
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

    /// The numbers of as many wheels as fit into a register: a register of samples holds those of one wheel.
    type Wheels: Wheels<Self>;

    /// The constant `value` for every sample.
    fn constant(value: f64) -> Self;

    /// Returns this number times a constant: `self * Self::constant(factor)`, cheaper for types that carry derivatives.
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

    /// Returns the value as a constant, with zero derivatives.
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
