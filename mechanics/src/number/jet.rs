//! Second-order time derivatives carried along with a value.

use std::ops::{Div, Mul};

use super::real::Real;

/// A value with its first and second time derivative: position, velocity and acceleration.
///
/// Position equations evaluated with it yield velocities and accelerations. Comparisons use the values
/// alone, so the derivatives are those of the branch taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jet<T> {
    /// The value.
    pub value: T,
    /// Its first derivative.
    pub first: T,
    /// Its second derivative.
    pub second: T,
}

impl<T: Real> Jet<T> {
    /// A constant: its time derivatives are zero.
    #[inline(always)]
    #[must_use]
    pub fn fixed(value: T) -> Self {
        Self {
            value,
            first: T::zero(),
            second: T::zero(),
        }
    }

    /// f(self) from f, f' and f'' at its value.
    #[inline(always)]
    fn chain(self, value: T, first: T, second: T) -> Self {
        Self {
            value,
            first: first * self.first,
            second: first * self.second + second * self.first * self.first,
        }
    }
}

impl<T: Real> Mul for Jet<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let both = self.first * other.first;
        Self {
            value: self.value * other.value,
            first: self.first * other.value + self.value * other.first,
            second: self.second * other.value + self.value * other.second + (both + both),
        }
    }
}

impl<T: Real> Div for Jet<T> {
    type Output = Self;
    /// Returns the quotient, from `quotient * other = self`, differentiated twice.
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let inverse = T::one() / other.value;
        let value = self.value / other.value;
        let first = (self.first - value * other.first) * inverse;
        let both = first * other.first;
        Self {
            value,
            first,
            second: (self.second - value * other.second - (both + both)) * inverse,
        }
    }
}

by_part!([inline(always)] Jet: value, first, second);
from_operations!([T: Real] Jet<T>);

impl<T: Real> Real for Jet<T> {
    type Mask = T::Mask;
    type Wheels = Self;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::fixed(T::constant(value))
    }

    #[inline(always)]
    fn scaled(self, factor: f64) -> Self {
        Self {
            value: self.value.scaled(factor),
            first: self.first.scaled(factor),
            second: self.second.scaled(factor),
        }
    }

    /// Returns the root, from `root^2 = self`, differentiated twice.
    #[inline(always)]
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        let inverse = T::one() / value;
        let first = self.first.scaled(0.5) * inverse;
        Self {
            value,
            first,
            second: (self.second.scaled(0.5) - first * first) * inverse,
        }
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.chain(sin, cos, -sin), self.chain(cos, -sin, -cos))
    }

    /// (x^2 + y^2) dangle = x dy - y dx, differentiated once more.
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        let y = self;
        let inverse = T::one() / (x.value * x.value + y.value * y.value);
        let first = (x.value * y.first - y.value * x.first) * inverse;
        let stretch = (x.value * x.first + y.value * y.first).scaled(2.0);
        let turned = x.value * y.second - y.value * x.second;
        Self {
            value: y.value.atan2(x.value),
            first,
            second: (turned - first * stretch) * inverse,
        }
    }

    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        self.value.lt(other.value)
    }

    #[inline(always)]
    fn select(mask: Self::Mask, if_true: Self, if_false: Self) -> Self {
        Self {
            value: T::select(mask, if_true.value, if_false.value),
            first: T::select(mask, if_true.first, if_false.first),
            second: T::select(mask, if_true.second, if_false.second),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Dual, Gradient};
    use super::*;

    /// Every operation of [`Real`].
    fn everything<T: Real>(x: T, y: T) -> T {
        let (sin, cos) = (x * y).sin_cos();
        let root = (x * x + (y * y).scaled(0.3)).sqrt();
        let mut z = (sin / (cos + T::constant(2.0)) - root) * y.atan2(x);
        z += -x.abs();
        z *= root.max(y).min(T::constant(5.0));
        z /= x + T::constant(3.0);
        z -= y;
        z
    }

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-13 * (1.0 + b.abs())
    }

    /// x = x + 0.3 t - 0.2 t^2 and y = y - 0.7 t + 0.1 t^2, and the same in dual numbers of dual numbers.
    #[test]
    fn both_derivatives_equal_nested_dual_numbers() {
        let jet = |value, first, second| Jet {
            value,
            first,
            second,
        };
        let nested = |value: f64, first: f64, second: f64| Dual {
            value: Dual {
                value,
                slope: first,
            },
            slope: Dual {
                value: first,
                slope: second,
            },
        };
        for [x, y] in [[0.7, -1.3], [-2.1, 0.4], [1e-3, 3.0]] {
            let found = everything(jet(x, 0.3, -0.4), jet(y, -0.7, 0.2));
            let expected = everything(nested(x, 0.3, -0.4), nested(y, -0.7, 0.2));
            assert_eq!(found.value.to_bits(), everything(x, y).to_bits());
            assert!(near(found.first, expected.value.slope), "{x} {y}");
            assert!(near(found.second, expected.slope.slope), "{x} {y}");
        }
    }

    #[test]
    fn gradient_equals_separate_dual_numbers() {
        for [x, y] in [[0.7, -1.3], [-2.1, 0.4], [1e-3, 3.0]] {
            let found = everything(Gradient::<2>::variable(x, 0), Gradient::variable(y, 1));
            let by_x = everything(Dual::variable(x), Dual::fixed(y));
            let by_y = everything(Dual::fixed(x), Dual::variable(y));
            assert_eq!(found.value.to_bits(), everything(x, y).to_bits());
            assert!(near(found.slopes[0], by_x.slope) && near(found.slopes[1], by_y.slope));
        }
    }
}
