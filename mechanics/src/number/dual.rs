//! Dual numbers: a value with its derivative along one direction.

use std::ops::{Div, Mul};

use super::real::Real;

/// A value and its exact derivative with respect to one variable: `a + b e` with `e^2 = 0`.
///
/// Equations evaluated with it yield their own derivative. Comparisons use the values alone, so the
/// derivative is that of the branch taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<T> {
    /// The value.
    pub value: T,
    /// Its derivative.
    pub slope: T,
}

impl<T: Real> Dual<T> {
    /// The variable of differentiation: its derivative is one.
    #[inline]
    #[must_use]
    pub fn variable(value: T) -> Self {
        Self {
            value,
            slope: T::one(),
        }
    }

    /// A constant: its derivative is zero.
    #[inline]
    #[must_use]
    pub fn fixed(value: T) -> Self {
        Self {
            value,
            slope: T::zero(),
        }
    }
}

impl<T: Real> Mul for Dual<T> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            slope: self.slope * other.value + self.value * other.slope,
        }
    }
}

impl<T: Real> Div for Dual<T> {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self {
            value,
            slope: (self.slope - value * other.slope) / other.value,
        }
    }
}

by_part!([inline] Dual: value, slope);
from_operations!([T: Real] Dual<T>);

impl<T: Real> Real for Dual<T> {
    type Mask = T::Mask;
    type Wheels = Self;

    #[inline]
    fn constant(value: f64) -> Self {
        Self::fixed(T::constant(value))
    }

    #[inline]
    fn held(self) -> Self {
        Self::fixed(self.value.held())
    }

    #[inline]
    fn scaled(self, factor: f64) -> Self {
        Self {
            value: self.value.scaled(factor),
            slope: self.slope.scaled(factor),
        }
    }

    #[inline]
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        Self {
            value,
            slope: self.slope / (value + value),
        }
    }

    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (
            Self {
                value: sin,
                slope: cos * self.slope,
            },
            Self {
                value: cos,
                slope: -sin * self.slope,
            },
        )
    }

    #[inline]
    fn atan2(self, x: Self) -> Self {
        let (y_by, x_by) = (self.slope * x.value, x.slope * self.value);
        Self {
            value: self.value.atan2(x.value),
            slope: (y_by - x_by) / (self.value * self.value + x.value * x.value),
        }
    }

    #[inline]
    fn lt(self, other: Self) -> Self::Mask {
        self.value.lt(other.value)
    }

    #[inline]
    fn select(mask: Self::Mask, if_true: Self, if_false: Self) -> Self {
        Self {
            value: T::select(mask, if_true.value, if_false.value),
            slope: T::select(mask, if_true.slope, if_false.slope),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dual_numbers_match_symbolic_derivatives() {
        let x = Dual::variable(0.7_f64);
        let (sin, cos) = (x * x).sin_cos();
        let y = (sin / (cos + Dual::constant(2.0))).sqrt() - x * Dual::constant(3.0);
        let f = |x: f64| ((x * x).sin() / ((x * x).cos() + 2.0)).sqrt() - 3.0 * x;
        let h = 1e-6;
        assert!((y.value - f(0.7)).abs() < 1e-15);
        assert!((y.slope - (f(0.7 + h) - f(0.7 - h)) / (2.0 * h)).abs() < 1e-8);
    }
}
