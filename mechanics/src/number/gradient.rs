//! A value with its derivatives with respect to a few variables.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::real::Real;

/// A value and its exact derivatives with respect to `N` variables: several [`Dual`](super::Dual) numbers
/// with a common value.
///
/// Comparisons use the values alone, so the derivatives are those of the branch taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gradient<const N: usize> {
    /// The value.
    pub value: f64,
    /// Its derivatives.
    pub slopes: [f64; N],
}

impl<const N: usize> Gradient<N> {
    /// A constant: its derivatives are zero.
    #[inline(always)]
    #[must_use]
    pub fn fixed(value: f64) -> Self {
        Self {
            value,
            slopes: [0.0; N],
        }
    }

    /// The variable with this index.
    #[inline(always)]
    #[must_use]
    pub fn variable(value: f64, index: usize) -> Self {
        let mut variable = Self::fixed(value);
        variable.slopes[index] = 1.0;
        variable
    }

    #[inline(always)]
    fn with(value: f64, slope: impl Fn(usize) -> f64) -> Self {
        let mut number = Self::fixed(value);
        for i in 0..N {
            number.slopes[i] = slope(i);
        }
        number
    }
}

impl<const N: usize> Add for Gradient<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::with(self.value + other.value, |i| {
            self.slopes[i] + other.slopes[i]
        })
    }
}

impl<const N: usize> Sub for Gradient<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::with(self.value - other.value, |i| {
            self.slopes[i] - other.slopes[i]
        })
    }
}

impl<const N: usize> Mul for Gradient<N> {
    type Output = Self;
    #[allow(
        clippy::suspicious_arithmetic_impl,
        reason = "the product rule is a sum"
    )]
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::with(self.value * other.value, |i| {
            self.slopes[i] * other.value + self.value * other.slopes[i]
        })
    }
}

impl<const N: usize> Div for Gradient<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let inverse = 1.0 / other.value;
        Self::with(value, |i| {
            (self.slopes[i] - value * other.slopes[i]) * inverse
        })
    }
}

impl<const N: usize> Neg for Gradient<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::with(-self.value, |i| -self.slopes[i])
    }
}

from_operations!([const N: usize] Gradient<N>);

impl<const N: usize> Real for Gradient<N> {
    type Mask = bool;
    type Wheels = Self;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::fixed(value)
    }

    #[inline(always)]
    fn scaled(self, factor: f64) -> Self {
        Self::with(self.value * factor, |i| self.slopes[i] * factor)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        let inverse = 0.5 / value;
        Self::with(value, |i| self.slopes[i] * inverse)
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = Real::sin_cos(self.value);
        (
            Self::with(sin, |i| cos * self.slopes[i]),
            Self::with(cos, |i| -sin * self.slopes[i]),
        )
    }

    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        let inverse = 1.0 / (self.value * self.value + x.value * x.value);
        Self::with(Real::atan2(self.value, x.value), |i| {
            (self.slopes[i] * x.value - x.slopes[i] * self.value) * inverse
        })
    }

    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self.value < other.value
    }

    #[inline(always)]
    fn select(mask: bool, if_true: Self, if_false: Self) -> Self {
        if mask { if_true } else { if_false }
    }
}
