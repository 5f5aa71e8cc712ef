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
    fn from_fn(number: impl Fn(usize) -> f64) -> Self {
        Self::from_array(std::array::from_fn(number))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wheels_side_by_side_keep_their_numbers() {
        let loads = [1.5, f64::NAN, -0.0, 4.0, 5.0, 6.0];
        for first in [0, 4] {
            let side_by_side = <Lanes as Wheels<f64>>::of(&loads[first..]);
            let doubled = side_by_side * Wheels::<f64>::each(2.0);
            for place in 0..<Lanes as Wheels<f64>>::COUNT {
                let alone = loads.get(first + place).copied().unwrap_or(0.0) * 2.0;
                let found: f64 = doubled.wheel(place);
                assert_eq!(found.to_bits(), alone.to_bits(), "wheel {}", first + place);
            }
        }
        assert_eq!(<Lanes as Wheels<Lanes>>::COUNT, 1);
    }
}
