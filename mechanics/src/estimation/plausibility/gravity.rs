//! Consistency of an IMU's attitude and specific force: both determine the direction of gravity.
//!
//! ```text
//!     a = R f - g z        the acceleration in level axes, from attitude and specific force
//!     m' = (a - m) / T     its mean, over the time since the start while that is less than T
//! ```
//! A machine that gains the speed dv has `|m| <= dv / T`; beyond a machine's maximum speed, one of the two
//! signals is wrong. Which one is undetermined; the fault is assigned to the attitude, which serves
//! only to estimate the accelerometer's bias, and is then not used for it.
//! Driving in circles has no effect, because the axes do not rotate, unless the attitude lacks a heading.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::notice::{Found, Limits, Notice};
use crate::machine::FaultKind;

/// The time over which the acceleration is averaged (s).
const AVERAGED_S: f64 = 10.0;

/// Mean acceleration of one IMU.
#[derive(Debug, Clone)]
pub(super) struct GravityWatch {
    gravity: f64,
    tolerance: f64,
    mean: Vector3<f64>,
    /// Time covered by the mean (s), at most [`AVERAGED_S`].
    known_s: f64,
    last_ns: Option<i64>,
}

impl GravityWatch {
    /// Gravity, and the largest mean acceleration (m/s^2).
    pub(super) fn new(gravity: f64, tolerance: f64) -> Self {
        Self {
            gravity,
            tolerance,
            mean: Vector3::zeros(),
            known_s: 0.0,
            last_ns: None,
        }
    }

    /// Reports to `found` if attitude and specific force up to this sample disagree. Both must be credible by
    /// themselves.
    pub(super) fn check(
        &mut self,
        stamp_ns: i64,
        specific_force: &[f64],
        xyzw: &[f64],
        limits: &Limits,
        found: &mut Found<'_>,
    ) {
        let (&[fx, fy, fz], &[x, y, z, w]) = (specific_force, xyzw) else {
            return;
        };
        let attitude = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let acceleration = attitude * Vector3::new(fx, fy, fz) - Vector3::z() * self.gravity;
        let last_ns = self.last_ns.replace(stamp_ns);
        let step_s = last_ns.map_or(0.0, |last| limits.elapsed_s(last, stamp_ns));
        if step_s > limits.max_gap_s {
            (self.known_s, self.mean) = (0.0, Vector3::zeros());
            return;
        }
        self.known_s = (self.known_s + step_s).min(AVERAGED_S);
        if self.known_s > 0.0 {
            self.mean += (acceleration - self.mean) * (step_s / self.known_s);
        }
        let apart = self.mean.norm();
        if self.known_s >= AVERAGED_S && apart > self.tolerance {
            found(
                Notice::of(FaultKind::Disagreement, stamp_ns)
                    .measured(apart, self.tolerance)
                    .amount(apart / self.gravity, 0.0),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::attitude::AttitudeWatch;
    use super::super::vector::VectorWatch;
    use super::*;

    const LIMITS: Limits = Limits::OF_TESTS;

    /// Time after which a fault is reported (s); samples every ten milliseconds.
    fn found_after_s(attitude: [f64; 4], force: impl Fn(f64) -> [f64; 3]) -> Option<f64> {
        let (mut measured, mut given) = (VectorWatch::new(39.2, None), AttitudeWatch::new());
        let mut watch = GravityWatch::new(9.81, 3.0);
        (0..6000_i64).find_map(|step| {
            let (stamp_ns, time_s) = (step * 10_000_000, step as f64 * 0.01);
            let mut found_s = None;
            let force = force(time_s);
            let is_felt = measured.check(stamp_ns, &force, false, &LIMITS, &mut |_| ());
            let is_given = given.check(
                stamp_ns,
                &attitude,
                Vector3::zeros(),
                false,
                &LIMITS,
                &mut |_| (),
            );
            if is_felt && is_given {
                watch.check(stamp_ns, &force, &attitude, &LIMITS, &mut |notice| {
                    assert_eq!(notice.kind, FaultKind::Disagreement);
                    found_s = Some(time_s);
                });
            }
            found_s
        })
    }

    const LEVEL: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

    #[test]
    fn machine_motion_is_no_disagreement() {
        // Repeated hard braking from 15 m/s, and a rough road.
        let braking = |t: f64| if t % 10.0 < 2.5 { -6.0 } else { 2.0 };
        let rough = |t: f64| 9.81 + 8.0 * (20.0 * t).sin();
        assert_eq!(found_after_s(LEVEL, |t| [braking(t), 0.0, rough(t)]), None);
        // An impossible force, which another check rejects.
        let spiked = |t: f64| {
            if (t - 12.0).abs() < 0.005 {
                1e300
            } else {
                9.81
            }
        };
        assert_eq!(found_after_s(LEVEL, |t| [0.0, 0.0, spiked(t)]), None);
        // No attitude, or one that another check rejects.
        let upside_down = |_: f64| [0.0, 0.0, -9.81];
        for none in [[f64::NAN; 4], [0.0; 4], [2.0, 0.0, 0.0, 0.0]] {
            assert_eq!(found_after_s(none, upside_down), None);
        }
    }

    #[test]
    fn wrong_attitude_and_scale_are_found_after_ten_seconds() {
        let half = f64::to_radians(12.5);
        let tilted = [half.sin(), 0.0, 0.0, half.cos()];
        for (attitude, force) in [
            (LEVEL, [0.0, 0.0, -9.81]),
            (tilted, [0.0, 0.0, 9.81]),
            (LEVEL, [0.0, 0.0, 1.0]),
        ] {
            let found_s = found_after_s(attitude, |_| force);
            assert!(
                found_s.is_some_and(|s| (s - 10.0).abs() < 0.02),
                "{found_s:?}"
            );
        }
    }

    #[test]
    fn gap_restarts_the_mean() {
        let mut watch = GravityWatch::new(9.81, 3.0);
        for step in 0..3000_i64 {
            let gaps = step / 900;
            let stamp_ns = step * 10_000_000 + gaps * 1_000_000_000;
            watch.check(stamp_ns, &[0.0, 0.0, 0.0], &LEVEL, &LIMITS, &mut |_| {
                panic!("reported within nine seconds")
            });
        }
    }
}
