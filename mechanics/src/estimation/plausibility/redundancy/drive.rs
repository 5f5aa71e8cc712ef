//! The speeds of the wheels compared with the specific force: which way the machine speeds up.
//!
//! Over the last T seconds, the wheels change the speed by a and the accelerometer by b,
//! ```text
//!     a = sum of dv                         v: speed by the wheels
//!     b = sum of (f - g up) . forward dt    without its mean over the last minute, which is a bias
//! ```
//! Wheels that spin or lock change their speed by more than the machine, or by less, but in the same direction. Only the
//! opposite direction contradicts: a wrong sign of the wheels, an IMU mounted the wrong way round. It needs no odometry.

use nalgebra::{Matrix3, Vector1, Vector3};

use super::super::notice::{Found, Limits};
use super::lasting::LastingDifference;
use super::leaky::{LeakyIntegral, opposition};
use super::low_pass::{LowPass, left};
use super::rolling::Rolled;

/// Time of the comparison T (s).
const COMPARED_S: f64 = 3.0;
/// Time over which a bias is averaged (s).
const BIAS_S: f64 = 60.0;
/// Change of speed in opposite directions (m/s), and the time for which it must last (s).
const OPPOSITE: f64 = 0.4;
const LASTING_S: f64 = 0.3;

/// State of the check.
#[derive(Debug, Clone)]
pub(in super::super) struct DriveWatch {
    base_from_imu: Matrix3<f64>,
    gravity: f64,
    rolled: Option<(i64, f64)>,
    /// Speed by the wheels at the last sample (m/s).
    speed: Option<f64>,
    wheels: LeakyIntegral<1>,
    imu: LeakyIntegral<1>,
    bias: LowPass<1>,
    last_ns: Option<i64>,
    apart: LastingDifference,
}

impl DriveWatch {
    pub(in super::super) fn new(base_from_imu: Matrix3<f64>, gravity: f64) -> Self {
        Self {
            base_from_imu,
            gravity,
            rolled: None,
            speed: None,
            wheels: LeakyIntegral::new(),
            imu: LeakyIntegral::new(),
            bias: LowPass::new(BIAS_S),
            last_ns: None,
            apart: LastingDifference::new(OPPOSITE, LASTING_S),
        }
    }

    /// Takes the motion by the wheels; `None`: it is not known.
    pub(in super::super) fn take_wheels(&mut self, stamp_ns: i64, rolled: Option<Rolled>) {
        self.rolled = rolled.map(|rolled| (stamp_ns, rolled.speed));
    }

    /// Takes specific force and up direction (IMU axes), and reports to `found` wheels that speed up while the machine
    /// slows down, or the reverse.
    pub(in super::super) fn check(
        &mut self,
        stamp_ns: i64,
        [force, up]: [&Vector3<f64>; 2],
        limits: &Limits,
        found: &mut Found<'_>,
    ) {
        let step_s = (self.last_ns.replace(stamp_ns))
            .map_or(0.0, |last_ns| limits.elapsed_s(last_ns, stamp_ns));
        let is_fresh = |at: i64| limits.elapsed_s(at, stamp_ns).abs() <= limits.max_gap_s;
        let rolled = self
            .rolled
            .filter(|(at, _)| is_fresh(*at) && step_s <= limits.max_gap_s);
        let Some((_, speed)) = rolled else {
            self.speed = None;
            self.wheels.reset();
            self.imu.reset();
            self.bias.reset();
            self.apart.reset();
            return;
        };
        let forward = (self.base_from_imu * (force - up * self.gravity)).x;
        let bias = self.bias.step(step_s, &Vector1::new(forward));
        let gained = speed - self.speed.replace(speed).unwrap_or(speed);
        let left = left(step_s, COMPARED_S);
        self.wheels.add(left, &Vector1::new(gained));
        self.imu
            .add(left, &((Vector1::new(forward) - bias) * step_s));
        let (a, b) = (self.wheels.value.x, self.imu.value.x);
        let opposite = opposition(a, b);
        self.apart.check(stamp_ns, opposite, limits, found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits::OF_TESTS;

    /// When a drive is first reported (s): it speeds up to 1.6 m/s from 3 s on and brakes at 8 s. `wheels` gives the speed by
    /// the wheels, `sign` turns the IMU, `bias` tilts it (m/s^2).
    fn found_s(wheels: impl Fn(f64, f64) -> f64, sign: f64, bias: f64) -> Option<f64> {
        let mut watch = DriveWatch::new(Matrix3::identity(), 9.8066);
        let mut found_s = None;
        let velocity = |t: f64| 0.8 * (t - 3.0).clamp(0.0, 2.0) - 1.6 * (t - 8.0).clamp(0.0, 1.0);
        for step in 0..1200_i64 {
            let (stamp_ns, time_s) = (step * 10_000_000, step as f64 * 0.01);
            let rolled = Rolled {
                speed: wheels(time_s, velocity(time_s)),
                by_speeds: None,
                by_steering: None,
            };
            watch.take_wheels(stamp_ns, Some(rolled));
            let acceleration = (velocity(time_s + 0.005) - velocity(time_s - 0.005)) / 0.01;
            let noise = 0.3 * (time_s * 97.0).sin();
            let force = Vector3::new(sign * acceleration + bias + noise, 0.0, 9.8066);
            watch.check(stamp_ns, [&force, &Vector3::z()], &LIMITS, &mut |_| {
                found_s.get_or_insert(time_s);
            });
        }
        found_s
    }

    #[test]
    fn wheels_that_agree_spin_or_lock_are_no_contradiction() {
        for bias in [-0.5, 0.0, 0.5] {
            assert_eq!(found_s(|_, v| v, 1.0, bias), None);
            // They spin at the start, and lock while the machine slides.
            let spinning = |t: f64, v: f64| if (3.0..4.0).contains(&t) { 3.0 * v } else { v };
            assert_eq!(found_s(spinning, 1.0, bias), None);
            let locked = |t: f64, v: f64| if t > 8.0 { 0.0 } else { v };
            assert_eq!(found_s(locked, 1.0, bias), None);
            assert_eq!(found_s(|_, _| 0.0, 1.0, bias), None);
        }
    }

    #[test]
    fn wrong_signs_are_found_when_the_machine_drives_off() {
        for bias in [-0.5, 0.0, 0.5] {
            for found in [found_s(|_, v| -v, 1.0, bias), found_s(|_, v| v, -1.0, bias)] {
                assert!(found.is_some_and(|s| s < 4.5), "{bias}: {found:?}");
            }
        }
    }

    #[test]
    fn numbers_that_are_none_report_nothing() {
        assert_eq!(found_s(|_, _| f64::NAN, 1.0, 0.0), None);
        assert_eq!(found_s(|_, v| v, f64::NAN, 0.0), None);
    }
}
