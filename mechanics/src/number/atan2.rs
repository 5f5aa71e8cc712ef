//! atan2 from the operations of [`Real`] alone: see [`sin_cos`](super::sin_cos).

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use super::real::Real;

/// pi/2 minus its nearest `f64`.
const HALF_PI_REST: f64 = 6.123_233_995_736_766e-17;

/// Above this tangent the angle is reduced by pi/4; the rational approximation is valid up to here.
const LARGEST_TANGENT: f64 = 0.66;

/// The smallest positive number.
const LEAST: f64 = f64::from_bits(1);

/// Rational minimax approximation (Cephes) on |x| <= 0.66, lowest power first:
/// atan x = x + x x^2 P(x^2) / Q(x^2).
const P: [f64; 5] = [
    -6.485_021_904_942_025e1,
    -1.228_866_684_490_136_2e2,
    -7.500_855_792_314_705e1,
    -1.615_753_718_733_365e1,
    -8.750_608_600_031_904e-1,
];

/// The denominator; the coefficient of x^10 is 1.
const Q: [f64; 5] = [
    1.945_506_571_482_614e2,
    4.853_903_996_359_137e2,
    4.328_810_604_912_902_7e2,
    1.650_270_098_316_988_5e2,
    2.485_846_490_142_306_3e1,
];

/// Angle of the direction (x, y) from the x axis (rad), -pi to pi, within 2 units in the last place.
///
/// Negative zero counts as zero, and the angle of (0, 0) is 0. NaN if either is NaN.
#[inline]
pub(super) fn atan2<T: Real>(y: T, x: T) -> T {
    let c = T::constant;
    let (opposite, adjacent) = (y.abs(), x.abs());
    let steep = adjacent.lt(opposite);
    let small = T::select(steep, adjacent, opposite);
    let large = T::select(steep, opposite, adjacent);
    let angle = arc_tangent(tangent(small, large));
    // Each rounded constant comes with its rounding error.
    let from_axis = T::select(steep, c(FRAC_PI_2) - (angle - c(HALF_PI_REST)), angle);
    let backwards = c(PI) - (from_axis - c(2.0 * HALF_PI_REST));
    let upper = T::select(x.lt(T::zero()), backwards, from_axis);
    T::select(y.lt(T::zero()), -upper, upper)
}

/// small / large in [0, 1], with 0 / 0 = 0 and infinity / infinity = 1.
#[inline]
fn tangent<T: Real>(small: T, large: T) -> T {
    let c = T::constant;
    let no_direction = small.lt(c(LEAST)) & large.lt(c(LEAST));
    let both_infinite = c(f64::MAX).lt(small) & c(f64::MAX).lt(large);
    let tangent = T::select(both_infinite, T::one(), small / large);
    T::select(no_direction, T::zero(), tangent)
}

/// atan t for t in [0, 1]: atan t = pi/4 + atan((t - 1) / (t + 1)).
#[inline]
fn arc_tangent<T: Real>(t: T) -> T {
    let c = T::constant;
    let from_diagonal = c(LARGEST_TANGENT).lt(t);
    let x = T::select(from_diagonal, (t - T::one()) / (t + T::one()), t);
    let x2 = x * x;
    let [p0, p1, p2, p3, p4] = P.map(c);
    let [q0, q1, q2, q3, q4] = Q.map(c);
    let p = p0 + x2 * (p1 + x2 * (p2 + x2 * (p3 + x2 * p4)));
    let q = q0 + x2 * (q1 + x2 * (q2 + x2 * (q3 + x2 * (q4 + x2))));
    let angle = x + x * (x2 * p / q);
    let turned = c(FRAC_PI_4) + (angle + c(0.5 * HALF_PI_REST));
    T::select(from_diagonal, turned, angle)
}

#[cfg(test)]
mod tests {
    use super::super::Lanes;
    use super::*;

    /// Directions all around, with magnitudes from the smallest to the largest.
    fn directions() -> impl Iterator<Item = (f64, f64)> {
        (0..60_000).map(|i| {
            let (s, c) = (f64::from(i) * 0.000_104_719_8 * 1.7).sin_cos();
            let scale = 10.0_f64.powi(i % 601 - 300);
            (s * scale, c * scale * 10.0_f64.powi(i % 7 - 3))
        })
    }

    #[test]
    fn agrees_with_platform_in_all_quadrants_and_magnitudes() {
        for (y, x) in directions() {
            let (found, expected) = (atan2(y, x), y.atan2(x));
            assert!(
                found.to_bits().abs_diff(expected.to_bits()) <= 2,
                "({x:e}, {y:e}): {found:e}, not {expected:e}"
            );
        }
    }

    #[test]
    fn small_angles_keep_relative_accuracy() {
        for i in 1..3000 {
            let y = f64::from(i) * 1e-3 * 10.0_f64.powi(-(i % 300));
            let (found, expected) = (atan2(y, 1.0), y.atan2(1.0));
            assert!(
                found.to_bits().abs_diff(expected.to_bits()) <= 2,
                "{y:e}: {found:e}, not {expected:e}"
            );
        }
    }

    #[test]
    fn axes_zeros_and_infinities_have_exact_angles() {
        let infinity = f64::INFINITY;
        let values = [0.0, 1.0, -1.0, 5e-324, f64::MAX, infinity, -infinity];
        for (y, x) in values.iter().flat_map(|&y| values.map(|x| (y, x))) {
            let (found, expected) = (atan2(y, x), y.atan2(x));
            assert!(
                (found - expected).abs() < 4.5e-16,
                "({x:e}, {y:e}): {found}"
            );
        }
        assert_eq!(atan2(0.0, 0.0), 0.0);
        assert_eq!(atan2(-0.0, -0.0), 0.0);
    }

    #[test]
    fn nan_input_gives_nan() {
        for other in [0.0, 1.0, -2.0, f64::INFINITY, f64::NAN] {
            assert!(atan2(f64::NAN, other).is_nan());
            assert!(atan2(other, f64::NAN).is_nan());
        }
    }

    #[test]
    fn lanes_equal_scalar_to_the_bit() {
        let special = [0.0, -0.0, f64::INFINITY, f64::NAN, -1.0, 1e-320];
        let specials = special.iter().flat_map(|&y| special.map(|x| (y, x)));
        let all: Vec<(f64, f64)> = directions().chain(specials).collect();
        for four in all.chunks_exact(4) {
            let [y, x] = [
                std::array::from_fn(|k| four[k].0),
                std::array::from_fn(|k| four[k].1),
            ]
            .map(Lanes::from_array);
            for (lane, &(y, x)) in Real::atan2(y, x).to_array().into_iter().zip(four) {
                let alone = Real::atan2(y, x);
                let same = lane.to_bits() == alone.to_bits();
                assert!(same || (lane.is_nan() && alone.is_nan()), "({x:e}, {y:e})");
            }
        }
    }
}
