//! Sine and cosine from the operations of [`Real`] alone, so that all number types give the same bits and
//! four lanes cost little more than one.

use super::real::Real;

/// 1.5 * 2^52: adding and subtracting it rounds a number below 2^51 to the nearest integer.
const ROUNDING: f64 = 6_755_399_441_055_744.0;

/// pi/2 in three parts, the first two with zeros at their ends, so that `k * part` is exact for
/// |k| < 2^20 (Cody and Waite's reduction).
const HALF_PI: [f64; 3] = [
    1.570_796_326_734_125_6,
    6.077_100_506_303_966e-11,
    2.022_266_248_795_950_6e-21,
];

/// Minimax coefficients on [-pi/4, pi/4], lowest power first: sin x = x + x^3 p(x^2).
const SIN: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];

/// cos x = 1 - x^2/2 + x^4 q(x^2).
const COS: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Sine and cosine of `angle` (rad): within 2 units in the last place up to 10^6 rad, less accurate beyond,
/// NaN for a non-finite angle.
#[inline]
pub(super) fn sin_cos<T: Real>(angle: T) -> (T, T) {
    let c = T::constant;
    let quarter_turns = (angle * c(std::f64::consts::FRAC_2_PI) + c(ROUNDING)) - c(ROUNDING);
    let x = ((angle - quarter_turns * c(HALF_PI[0])) - quarter_turns * c(HALF_PI[1]))
        - quarter_turns * c(HALF_PI[2]);
    let x2 = x * x;
    let sin = x + x * x2 * polynomial(x2, &SIN);
    let cos = (T::one() - x2 * c(0.5)) + x2 * x2 * polynomial(x2, &COS);
    // Quadrant 0 to 3: quarter turns modulo 4, rounded into -2..2.
    let rounded_fourth = (quarter_turns * c(0.25) + c(ROUNDING)) - c(ROUNDING);
    let remainder = quarter_turns - rounded_fourth * c(4.0);
    let odd = c(0.5).lt(remainder.abs()) & remainder.abs().lt(c(1.5));
    let half_turn = c(1.5).lt(remainder.abs());
    let sin_negative = remainder.lt(c(-0.5)) | half_turn;
    let cos_negative = c(0.5).lt(remainder);
    let (s, k) = (T::select(odd, cos, sin), T::select(odd, sin, cos));
    // By quadrant: 0 (s, c), 1 (c, -s), +-2 (-s, -c), -1 (-c, s).
    (
        T::select(sin_negative, -s, s),
        T::select(cos_negative | remainder.lt(c(-1.5)), -k, k),
    )
}

#[inline]
fn polynomial<T: Real>(x: T, coefficients: &[f64; 6]) -> T {
    let [c0, c1, c2, c3, c4, c5] = coefficients.map(T::constant);
    c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * c5))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_platform_over_many_turns() {
        let mut worst: f64 = 0.0;
        for i in -200_000..200_000 {
            let angle = f64::from(i) * 0.001_234_567;
            let (s, c) = sin_cos(angle);
            worst = worst
                .max((s - angle.sin()).abs())
                .max((c - angle.cos()).abs());
        }
        assert!(worst < 3e-16, "worst error {worst:e}");
        for angle in [
            1e4,
            -1e5,
            9.9e5,
            std::f64::consts::PI,
            -std::f64::consts::FRAC_PI_2,
        ] {
            let (s, c) = sin_cos(angle);
            assert!(
                (s - angle.sin()).abs() < 1e-13 && (c - angle.cos()).abs() < 1e-13,
                "{angle}"
            );
        }
    }

    #[test]
    fn non_finite_angle_gives_nan() {
        for angle in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let (s, c) = sin_cos(angle);
            assert!(s.is_nan() && c.is_nan());
        }
    }
}
