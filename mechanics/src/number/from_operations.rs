//! Common implementations of numbers with derivatives.

/// Sum, difference and negative of a number, part by part.
macro_rules! by_part {
    ([$inline:meta] $number:ident: $($part:ident),+) => {
        by_part!([$inline] $number: $($part),+; Add, add, +);
        by_part!([$inline] $number: $($part),+; Sub, sub, -);

        impl<T: Real> std::ops::Neg for $number<T> {
            type Output = Self;
            #[$inline]
            fn neg(self) -> Self {
                Self { $($part: -self.$part),+ }
            }
        }
    };
    ([$inline:meta] $number:ident: $($part:ident),+; $trait:ident, $method:ident, $sign:tt) => {
        impl<T: Real> std::ops::$trait for $number<T> {
            type Output = Self;
            #[$inline]
            fn $method(self, other: Self) -> Self {
                Self { $($part: self.$part $sign other.$part),+ }
            }
        }
    };
}

/// `op=`, zero and one of a number with derivatives, from its `op` and its `fixed`.
macro_rules! from_operations {
    ([$($generic:tt)*] $number:ty) => {
        from_operations!([$($generic)*] $number, AddAssign, add_assign, Add, add);
        from_operations!([$($generic)*] $number, SubAssign, sub_assign, Sub, sub);
        from_operations!([$($generic)*] $number, MulAssign, mul_assign, Mul, mul);
        from_operations!([$($generic)*] $number, DivAssign, div_assign, Div, div);

        impl<$($generic)*> num_traits::Zero for $number {
            #[inline(always)]
            fn zero() -> Self {
                Self::fixed(num_traits::Zero::zero())
            }

            fn is_zero(&self) -> bool {
                *self == num_traits::Zero::zero()
            }
        }

        impl<$($generic)*> num_traits::One for $number {
            #[inline(always)]
            fn one() -> Self {
                Self::fixed(num_traits::One::one())
            }
        }
    };
    ([$($generic:tt)*] $number:ty, $trait:ident, $method:ident, $operation:ident, $plain:ident) => {
        impl<$($generic)*> std::ops::$trait for $number {
            #[inline(always)]
            fn $method(&mut self, other: Self) {
                *self = std::ops::$operation::$plain(*self, other);
            }
        }
    };
}
