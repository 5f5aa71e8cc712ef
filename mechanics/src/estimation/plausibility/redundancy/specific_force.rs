//! The specific force compared with attitude, angular velocity and odometry.
//!
//! An accelerometer with the velocity v, all in its own axes, measures
//! ```text
//!     f = dv/dt + w x v + g up
//! ```
//! Averaged by a low-pass filter L of time constant T, without differentiating the velocity, the error is
//! ```text
//!     e = L(f - g up - w x v) - (v - L(v)) / T
//! ```
//! Braked wheels that slide let the odometry jump by the speed lost: e is then large for a short time only, so it
//! must last before it is a contradiction.

use nalgebra::{Matrix3, Vector3};

use super::super::notice::{Found, Limits};
use super::lasting::LastingDifference;
use super::low_pass::{LowPass, share};
use super::travel::Travel;
use crate::machine::{Machine, rotation_in_body};

/// Averaging time T (s).
const AVERAGED_S: f64 = 1.0;
/// Time for which the error must last (s).
const LASTING_S: f64 = 1.5;

/// State of the check.
#[derive(Debug, Clone)]
pub(in super::super) struct SpecificForceWatch {
    gravity: f64,
    imu_from_base: Matrix3<f64>,
    /// Position of the IMU in the base (m, IMU axes).
    position: Vector3<f64>,
    error: LowPass<3>,
    velocity: LowPass<3>,
    last_ns: Option<i64>,
    apart: LastingDifference,
}

impl SpecificForceWatch {
    pub(in super::super) fn new(machine: &Machine) -> Self {
        let imu = machine.imu();
        let imu_from_base = rotation_in_body(imu).transpose();
        Self {
            gravity: machine.gravity(),
            position: imu_from_base * imu.body_from_mount.translation.vector,
            imu_from_base,
            error: LowPass::new(AVERAGED_S),
            velocity: LowPass::new(AVERAGED_S),
            last_ns: None,
            apart: LastingDifference::new(
                machine.plausibility().specific_force_tolerance,
                LASTING_S,
            ),
        }
    }

    /// Reports to `found` if the specific force differs. `up` is the up direction by the attitude; vectors are in IMU
    /// axes.
    pub(in super::super) fn check(
        &mut self,
        stamp_ns: i64,
        [force, turning, up]: [&Vector3<f64>; 3],
        travel: &Travel,
        limits: &Limits,
        found: &mut Found<'_>,
    ) {
        let step_s = (self.last_ns.replace(stamp_ns))
            .map_or(0.0, |last_ns| limits.elapsed_s(last_ns, stamp_ns));
        let base = travel.velocity(stamp_ns, limits.max_gap_s);
        let Some(base) = base.filter(|_| step_s <= limits.max_gap_s) else {
            self.error.reset();
            self.velocity.reset();
            self.apart.reset();
            return;
        };
        let velocity = self.imu_from_base * base + turning.cross(&self.position);
        let acceleration = force - up * self.gravity - turning.cross(&velocity);
        let share = share(step_s, AVERAGED_S);
        let mean = self.error.step_by(share, &acceleration);
        let gained = velocity - self.velocity.step_by(share, &velocity);
        let apart = (mean - gained / AVERAGED_S).norm();
        self.apart.check(stamp_ns, apart, limits, found);
    }
}
