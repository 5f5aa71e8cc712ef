//! A number with its gradient and Hessian by a few variables.

use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use num_traits::{One, Zero};

use super::Real;

/// A value and its exact first and second derivatives by `N` variables.
///
/// The equations evaluated with it give their own curvature. By one variable, time, it is a motion:
/// position, velocity and acceleration together. A comparison looks at values alone, so that the
/// derivatives are those of the branch taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondOrder<T, const N: usize> {
    /// The value.
    pub value: T,
    /// Its first derivatives.
    pub gradient: [T; N],
    /// Its second derivatives, symmetric.
    pub hessian: [[T; N]; N],
}

impl<T: Real, const N: usize> SecondOrder<T, N> {
    /// A number that depends on no variable.
    #[inline(always)]
    #[must_use]
    pub fn fixed(value: T) -> Self {
        let none = T::zero();
        Self {
            value,
            gradient: [none; N],
            hessian: [[none; N]; N],
        }
    }

    /// The variable of this index itself.
    #[inline(always)]
    #[must_use]
    pub fn variable(value: T, index: usize) -> Self {
        let mut variable = Self::fixed(value);
        variable.gradient[index] = T::one();
        variable
    }

    /// From its derivatives; `second(i, j)` is asked for i <= j alone.
    #[inline(always)]
    fn from_parts(
        value: T,
        first: impl Fn(usize) -> T,
        second: impl Fn(usize, usize, &[T; N]) -> T,
    ) -> Self {
        let mut number = Self::fixed(value);
        for i in 0..N {
            number.gradient[i] = first(i);
        }
        for i in 0..N {
            for j in i..N {
                let both = second(i, j, &number.gradient);
                number.hessian[i][j] = both;
                number.hessian[j][i] = both;
            }
        }
        number
    }

    /// f(self) from f, f' and f'' at its value.
    #[inline(always)]
    fn chain(self, value: T, first: T, second: T) -> Self {
        let g = &self.gradient;
        Self::from_parts(
            value,
            |i| g[i] * first,
            |i, j, _| self.hessian[i][j] * first + g[i] * g[j] * second,
        )
    }
}

impl<T: Real> SecondOrder<T, 1> {
    /// A motion in time: position, velocity, acceleration.
    #[inline(always)]
    #[must_use]
    pub fn motion(position: T, velocity: T, acceleration: T) -> Self {
        Self {
            value: position,
            gradient: [velocity],
            hessian: [[acceleration]],
        }
    }

    /// The same number among two variables, of which it depends on that of this index.
    #[inline(always)]
    #[must_use]
    pub fn among_two(self, index: usize) -> SecondOrder<T, 2> {
        let mut wider = SecondOrder::fixed(self.value);
        wider.gradient[index] = self.gradient[0];
        wider.hessian[index][index] = self.hessian[0][0];
        wider
    }
}

impl<T: Real, const N: usize> Add for SecondOrder<T, N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::from_parts(
            self.value + other.value,
            |i| self.gradient[i] + other.gradient[i],
            |i, j, _| self.hessian[i][j] + other.hessian[i][j],
        )
    }
}

impl<T: Real, const N: usize> Sub for SecondOrder<T, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::from_parts(
            self.value - other.value,
            |i| self.gradient[i] - other.gradient[i],
            |i, j, _| self.hessian[i][j] - other.hessian[i][j],
        )
    }
}

impl<T: Real, const N: usize> Mul for SecondOrder<T, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (a, b) = (&self, &other);
        Self::from_parts(
            a.value * b.value,
            |i| a.gradient[i] * b.value + a.value * b.gradient[i],
            |i, j, _| {
                (a.hessian[i][j] * b.value + a.value * b.hessian[i][j])
                    + (a.gradient[i] * b.gradient[j] + a.gradient[j] * b.gradient[i])
            },
        )
    }
}

impl<T: Real, const N: usize> Div for SecondOrder<T, N> {
    type Output = Self;
    /// From `quotient * other = self`, differentiated twice.
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let (a, b) = (&self, &other);
        let value = a.value / b.value;
        let inverse = T::one() / b.value;
        Self::from_parts(
            value,
            |i| (a.gradient[i] - value * b.gradient[i]) * inverse,
            |i, j, gradient| {
                let both = gradient[i] * b.gradient[j] + gradient[j] * b.gradient[i];
                (a.hessian[i][j] - value * b.hessian[i][j] - both) * inverse
            },
        )
    }
}

impl<T: Real, const N: usize> Neg for SecondOrder<T, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::from_parts(
            -self.value,
            |i| -self.gradient[i],
            |i, j, _| -self.hessian[i][j],
        )
    }
}

/// `SecondOrder op= SecondOrder` from `SecondOrder op SecondOrder`.
macro_rules! assigning {
    ($trait:ident, $method:ident, $operation:ident, $plain:ident) => {
        impl<T: Real, const N: usize> $trait for SecondOrder<T, N> {
            #[inline(always)]
            fn $method(&mut self, other: Self) {
                *self = $operation::$plain(*self, other);
            }
        }
    };
}

assigning!(AddAssign, add_assign, Add, add);
assigning!(SubAssign, sub_assign, Sub, sub);
assigning!(MulAssign, mul_assign, Mul, mul);
assigning!(DivAssign, div_assign, Div, div);

impl<T: Real, const N: usize> Zero for SecondOrder<T, N> {
    #[inline(always)]
    fn zero() -> Self {
        Self::fixed(T::zero())
    }

    fn is_zero(&self) -> bool {
        *self == Self::zero()
    }
}

impl<T: Real, const N: usize> One for SecondOrder<T, N> {
    #[inline(always)]
    fn one() -> Self {
        Self::fixed(T::one())
    }
}

impl<T: Real, const N: usize> Real for SecondOrder<T, N> {
    type Mask = T::Mask;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::fixed(T::constant(value))
    }

    #[inline(always)]
    fn scaled(self, factor: f64) -> Self {
        Self::from_parts(
            self.value.scaled(factor),
            |i| self.gradient[i].scaled(factor),
            |i, j, _| self.hessian[i][j].scaled(factor),
        )
    }

    /// From `root^2 = self`, differentiated twice.
    #[inline(always)]
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        let inverse = T::one() / value;
        let half = T::constant(0.5);
        Self::from_parts(
            value,
            |i| self.gradient[i] * half * inverse,
            |i, j, gradient| (self.hessian[i][j] * half - gradient[i] * gradient[j]) * inverse,
        )
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.chain(sin, cos, -sin), self.chain(cos, -sin, -cos))
    }

    /// (x^2 + y^2) dangle = x dy - y dx, differentiated once more.
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        let (y, x, two) = (&self, &x, T::constant(2.0));
        let inverse = T::one() / (x.value * x.value + y.value * y.value);
        Self::from_parts(
            y.value.atan2(x.value),
            |i| (x.value * y.gradient[i] - y.value * x.gradient[i]) * inverse,
            |i, j, gradient| {
                let turned = x.value * y.hessian[i][j] - y.value * x.hessian[i][j]
                    + x.gradient[j] * y.gradient[i]
                    - y.gradient[j] * x.gradient[i];
                let stretch = (x.value * x.gradient[j] + y.value * y.gradient[j]) * two;
                (turned - gradient[i] * stretch) * inverse
            },
        )
    }

    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        self.value.lt(other.value)
    }

    #[inline(always)]
    fn select(mask: Self::Mask, if_true: Self, if_false: Self) -> Self {
        Self::from_parts(
            T::select(mask, if_true.value, if_false.value),
            |i| T::select(mask, if_true.gradient[i], if_false.gradient[i]),
            |i, j, _| T::select(mask, if_true.hessian[i][j], if_false.hessian[i][j]),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::Dual;
    use super::*;

    /// Every operation of [`Real`].
    fn everything<T: Real>(x: T, y: T) -> T {
        let (sin, cos) = (x * y).sin_cos();
        let root = (x * x + y * y * T::constant(0.3)).sqrt();
        let mut z = (sin / (cos + T::constant(2.0)) - root) * y.atan2(x);
        z += -x.abs();
        z *= root.max(y).min(T::constant(5.0));
        z /= x + T::constant(3.0);
        z -= y;
        z
    }

    /// The second derivative along two directions in dual numbers of dual numbers.
    fn nested([x, y]: [f64; 2], i: usize, j: usize) -> Dual<Dual<f64>> {
        let seed = |value: f64, k: usize| {
            let one = |index: usize| if index == k { 1.0 } else { 0.0 };
            let inner = Dual {
                value,
                slope: one(i),
            };
            Dual {
                value: inner,
                slope: Dual::fixed(one(j)),
            }
        };
        everything(seed(x, 0), seed(y, 1))
    }

    #[test]
    fn gradient_and_hessian_are_those_of_nested_dual_numbers() {
        for point in [[0.7, -1.3], [-2.1, 0.4], [1e-3, 3.0]] {
            let [x, y] = point;
            let found = everything(
                SecondOrder::<f64, 2>::variable(x, 0),
                SecondOrder::variable(y, 1),
            );
            assert_eq!(found.value.to_bits(), everything(x, y).to_bits());
            for i in 0..2 {
                for j in 0..2 {
                    let expected = nested(point, i, j);
                    let near = |a: f64, b: f64| (a - b).abs() < 1e-13 * (1.0 + b.abs());
                    assert!(near(found.gradient[i], expected.value.slope), "{point:?}");
                    assert!(near(found.hessian[i][j], expected.slope.slope), "{point:?}");
                }
            }
        }
    }

    #[test]
    fn by_one_variable_it_is_a_motion() {
        // x = 0.4 + 0.3 t - 0.2 t^2, angle = atan2(sin x, 2 + cos x) against differences
        let at = |t: f64| 0.4 + 0.3 * t - 0.2 * t * t;
        let angle = |t: f64| f64::atan2(at(t).sin(), 2.0 + at(t).cos());
        let (sin, cos) = SecondOrder::motion(0.4, 0.3, -0.4).sin_cos();
        let found = sin.atan2(cos + SecondOrder::constant(2.0));
        let h = 1e-4;
        let velocity = (angle(h) - angle(-h)) / (2.0 * h);
        let acceleration = (angle(h) - 2.0 * angle(0.0) + angle(-h)) / (h * h);
        assert!((found.gradient[0] - velocity).abs() < 1e-8);
        assert!((found.hessian[0][0] - acceleration).abs() < 1e-6);
    }
}
