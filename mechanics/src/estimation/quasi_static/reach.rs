//! Range of a signal between two samples.

use super::range::Span;

/// Positions between samples `x0` and `x1`, `t` seconds apart, of a signal whose velocity is at most `v` and whose
/// acceleration is at most `a`:
///
/// ```text
///     by velocity:       x <= (x0 + x1 + v t) / 2
///     by acceleration:   x <= max over s of  x0 + c s + a s (t - s) / 2,   c = (x1 - x0) / t,
/// ```
/// reached at `s = t/2 + c/a`, and at an end where that lies outside. Both hold, and both are attained.
pub(super) fn positions(x: [f64; 2], t: f64, v: f64, a: f64) -> Span {
    let upper = |x0: f64, x1: f64| {
        let c = (x1 - x0) / t;
        let s = (0.5 * t + c / a).clamp(0.0, t);
        let by_acceleration = x0 + c * s + 0.5 * a * s * (t - s);
        let by_velocity = 0.5 * (x0 + x1 + v * t);
        by_acceleration.min(by_velocity).max(x0).max(x1)
    };
    Span {
        low: -upper(-x[0], -x[1]),
        high: upper(x[0], x[1]),
    }
}

/// Values between two samples of a signal that changes at most at the rate `r`.
pub(super) fn values(x: [f64; 2], t: f64, r: f64) -> Span {
    let half = 0.5 * r * t;
    let middle = 0.5 * (x[0] + x[1]);
    Span {
        low: (middle - half).min(x[0]).min(x[1]),
        high: (middle + half).max(x[0]).max(x[1]),
    }
}

/// Velocities between two samples of a position, where none is measured: the mean velocity c is passed somewhere,
/// and `|x' - c| <= a t / 2` follows from `|x''| <= a` at both ends, which are worst.
pub(super) fn velocities(x: [f64; 2], t: f64, v: f64, a: f64) -> Span {
    let c = (x[1] - x[0]) / t;
    let half = 0.5 * a * t;
    Span {
        low: (c - half).max(-v).min(c),
        high: (c + half).min(v).max(c),
    }
}

/// Returns the largest angle between a direction and the shortest arc between two samples (rad), `t` seconds apart, by its
/// largest rate and acceleration.
pub(super) fn turn(t: f64, rate: f64, acceleration: f64) -> f64 {
    (0.5 * rate * t).min(0.125 * acceleration * t * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The motion that accelerates with +a and then with -a from `x0` to `x1` in `t`.
    fn farthest(x: [f64; 2], t: f64, a: f64) -> f64 {
        // constant deceleration: x = x0 + u s - a s^2 / 2 with u chosen to end at x1
        let u = (x[1] - x[0]) / t + 0.5 * a * t;
        (0..=1000)
            .map(|k| {
                let s = t * f64::from(k) / 1000.0;
                x[0] + u * s - 0.5 * a * s * s
            })
            .fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn val_the_reach_by_acceleration_is_attained() {
        for (x, t, a) in [
            ([0.0, 0.0], 1.0, 0.5),
            ([0.2, -0.1], 2.0, 0.4),
            ([1.0, 3.0], 1.0, 0.1),
        ] {
            let found = positions(x, t, 1e9, a).high;
            assert!((found - farthest(x, t, a)).abs() < 1e-6, "{x:?} {found}");
        }
        // a t^2 / 8
        assert!((positions([0.0; 2], 2.0, 1e9, 0.4).high - 0.2).abs() < 1e-12);
    }

    #[test]
    fn val_the_reach_by_velocity_is_a_triangle() {
        let found = positions([0.0, 0.2], 1.0, 0.6, 1e9);
        assert!((found.high - 0.4).abs() < 1e-6 && (found.low + 0.2).abs() < 1e-6);
    }

    #[test]
    fn no_motion_within_the_bounds_leaves_its_reach() {
        // sines of every phase with the greatest velocity and acceleration of their own
        for k in 0..2000 {
            let f = f64::from(k);
            let (amplitude, w, phase) =
                (0.1 + (f * 0.37).fract(), 0.3 + 5.0 * (f * 0.73).fract(), f);
            let x = |s: f64| amplitude * (w * s + phase).sin();
            let (v, a) = (amplitude * w, amplitude * w * w);
            let t = 0.2 + 3.0 * (f * 0.19).fract();
            let reach = positions([x(0.0), x(t)], t, v, a);
            let rates = velocities([x(0.0), x(t)], t, v, a);
            for i in 0..=50 {
                let s = t * f64::from(i) / 50.0;
                let rate = amplitude * w * (w * s + phase).cos();
                assert!(reach.low - 1e-9 <= x(s) && x(s) <= reach.high + 1e-9);
                assert!(rates.low - 1e-9 <= rate && rate <= rates.high + 1e-9);
                let value = values([x(0.0), x(t)], t, v);
                assert!(value.low - 1e-9 <= x(s) && x(s) <= value.high + 1e-9);
            }
        }
    }
}
