//! `f64` as the number of one sample.

use super::atan2::atan2;
use super::lanes::Lanes;
use super::real::{Mask, Real, Wheels};
use super::sin_cos::sin_cos;

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
    type Wheels = Lanes;

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
        sin_cos(self)
    }

    #[inline]
    fn atan2(self, x: Self) -> Self {
        atan2(self, x)
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

impl Wheels<f64> for Lanes {
    const COUNT: usize = Self::COUNT;

    #[inline(always)]
    fn each(number: f64) -> Self {
        Self::constant(number)
    }

    #[inline(always)]
    fn of(numbers: &[f64]) -> Self {
        let mut lanes = [0.0; Self::COUNT];
        match numbers.first_chunk() {
            Some(all) => lanes = *all,
            None => lanes[..numbers.len()].copy_from_slice(numbers),
        }
        Self::from_array(lanes)
    }

    #[inline(always)]
    fn wheel(self, place: usize) -> f64 {
        self.to_array()[place]
    }
}
