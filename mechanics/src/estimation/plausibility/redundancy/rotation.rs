//! The angular velocity compared with the change of the attitude: both tell how the IMU turns.
//!
//! ```text
//!     a, b: rotation by the attitude, and the integral of the angular velocity, over the last T seconds (IMU axes)
//!     |a - b| > tolerance + share max(|a|, |b|)
//! ```
//! A wrong sign, a permuted axis, a wrong scale, a stuck or a far too large value all leave such a difference, as soon as
//! the IMU turns. About the vertical, a compass near a steel arm errs by much, and an attitude without heading does not
//! turn at all: there the tolerance is larger, and an attitude whose heading stands still is not compared.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::super::notice::{Found, Limits};
use super::lasting::LastingDifference;
use super::leaky::LeakyIntegral;
use super::low_pass::left;

/// Time of the comparison T (s).
const COMPARED_S: f64 = 2.0;
/// Time for which the difference must last (s).
const LASTING_S: f64 = 0.3;
/// Tolerance of the inclination and of the heading (rad), beside a share of the rotation.
const TOLERANCE: [f64; 2] = [0.06, 0.3];
const SHARE: f64 = 0.3;
/// Rotation about the vertical below which the attitude has no heading (rad).
const NO_HEADING: f64 = 0.02;

/// State of the check.
#[derive(Debug, Clone)]
pub(in super::super) struct RotationWatch {
    last: Option<(i64, UnitQuaternion<f64>, Vector3<f64>)>,
    attitude: LeakyIntegral<3>,
    gyro: LeakyIntegral<3>,
    apart: [LastingDifference; 2],
}

impl RotationWatch {
    pub(in super::super) fn new() -> Self {
        // The difference is checked as what exceeds the tolerance.
        let apart = || LastingDifference::new(0.0, LASTING_S);
        Self {
            last: None,
            attitude: LeakyIntegral::new(),
            gyro: LeakyIntegral::new(),
            apart: [apart(), apart()],
        }
    }

    /// Reports to `found` if the angular velocity (IMU axes) differs from the change of the attitude, a unit quaternion
    /// x y z w. One of them is missing: `None`.
    pub(in super::super) fn check(
        &mut self,
        stamp_ns: i64,
        measured: Option<(&[f64], &Vector3<f64>)>,
        limits: &Limits,
        found: &mut Found<'_>,
    ) {
        let measured = measured.and_then(|(xyzw, turning)| {
            let &[x, y, z, w] = xyzw else { return None };
            let attitude = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.1)?;
            Some((stamp_ns, attitude, *turning))
        });
        let last = std::mem::replace(&mut self.last, measured);
        let step_s = last.map(|(last_ns, ..)| limits.elapsed_s(last_ns, stamp_ns));
        let (Some((_, attitude, turning)), Some((_, before, turning_before)), Some(step_s)) = (
            measured,
            last,
            step_s.filter(|step_s| *step_s <= limits.max_gap_s),
        ) else {
            self.attitude.reset();
            self.gyro.reset();
            self.apart.iter_mut().for_each(LastingDifference::reset);
            return;
        };
        let rotation = (before.inverse() * attitude).scaled_axis();
        let left = left(step_s, COMPARED_S);
        self.attitude.add(left, &rotation);
        self.gyro
            .add(left, &((turning + turning_before) * (0.5 * step_s)));
        let up = attitude.inverse_transform_vector(&Vector3::z());
        let (a, b) = (self.attitude.value, self.gyro.value);
        let [of_a, of_b] = [a, b].map(|turned| turned.dot(&up));
        let level = [a - up * of_a, b - up * of_b];
        let tilted = (level[0] - level[1]).norm();
        let largest = level.map(|turned| turned.norm());
        // A heading that is not measured does not move; a compass errs, but it moves.
        let heading = if of_a.abs() < NO_HEADING {
            0.0
        } else {
            (of_a - of_b).abs()
        };
        let compared = [
            (tilted, largest[0].max(largest[1])),
            (heading, of_a.abs().max(of_b.abs())),
        ];
        let mut first = None;
        let checks = self.apart.iter_mut().zip(TOLERANCE).zip(compared);
        for ((apart, tolerance), (difference, size)) in checks {
            let allowed = tolerance + SHARE * size;
            apart.check_beyond(stamp_ns, difference, allowed, limits, &mut |notice| {
                first.get_or_insert(notice);
            });
        }
        if let Some(notice) = first {
            found(notice);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits::OF_TESTS;

    /// Time of the first report (s) in 20 s at 100 Hz: the machine rocks and turns; `gyro` makes the measured angular
    /// velocity of the true one, `attitude` the measured attitude.
    fn found_after_s(
        gyro: impl Fn(Vector3<f64>) -> Vector3<f64>,
        attitude: impl Fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>,
    ) -> Option<f64> {
        let mut watch = RotationWatch::new();
        let mut true_attitude = UnitQuaternion::identity();
        (0..2000_i64).find_map(|step| {
            let time_s = step as f64 * 0.01;
            let turning = Vector3::new(0.25 * (1.3 * time_s).sin(), 0.2 * time_s.cos(), 0.4);
            true_attitude *= UnitQuaternion::from_scaled_axis(turning * 0.01);
            let given = attitude(true_attitude);
            let xyzw = given.coords.as_slice().to_vec();
            let mut found_s = None;
            let turning = gyro(turning);
            let measured = Some((&xyzw[..], &turning));
            watch.check(step * 10_000_000, measured, &LIMITS, &mut |_| {
                found_s = Some(time_s);
            });
            found_s
        })
    }

    fn same<T>(value: T) -> T {
        value
    }

    #[test]
    fn right_gyro_with_a_bias_agrees() {
        let bias = Vector3::new(0.01, -0.01, 0.02);
        assert_eq!(found_after_s(|w| w * 1.05 + bias, same), None);
    }

    #[test]
    fn wrong_signs_axes_and_scales_are_found() {
        let wrong: [fn(Vector3<f64>) -> Vector3<f64>; 6] = [
            |w| Vector3::new(-w.x, w.y, w.z),
            |w| Vector3::new(w.x, -w.y, w.z),
            |w| Vector3::new(w.x, w.y, -w.z),
            |w| Vector3::new(w.y, w.x, w.z),
            |w| w * 2.0,
            |w| w * 0.0,
        ];
        for (index, gyro) in wrong.into_iter().enumerate() {
            let found_s = found_after_s(gyro, same);
            assert!(found_s.is_some_and(|s| s < 4.0), "{index}: {found_s:?}");
        }
    }

    #[test]
    fn attitude_without_heading_is_not_compared_about_the_vertical() {
        let without = |attitude: UnitQuaternion<f64>| {
            let (roll, pitch, _) = attitude.euler_angles();
            UnitQuaternion::from_euler_angles(roll, pitch, 0.0)
        };
        // About the vertical alone: the axes of the machine would turn against the slope.
        let mut watch = RotationWatch::new();
        for step in 0..2000_i64 {
            let attitude = without(UnitQuaternion::from_euler_angles(
                0.0,
                0.0,
                step as f64 * 0.004,
            ));
            let xyzw = attitude.coords.as_slice().to_vec();
            let turning = Vector3::new(0.0, 0.0, 0.4);
            let measured = Some((&xyzw[..], &turning));
            watch.check(step * 10_000_000, measured, &LIMITS, &mut |_| {
                panic!("reported")
            });
        }
    }
}
