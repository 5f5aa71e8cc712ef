//! The IMU's attitude against that of the odometry: both measure how the machine stands on the slope.
//!
//! An odometry that takes its attitude from the same IMU agrees with it, and shows nothing. Headings are not compared: they
//! count from different origins.

use nalgebra::Vector3;

use super::super::attitude::up_direction;
use super::hypotheses::{Compared, Hypotheses};
use super::likelihood::{Mixture, Standing};
use crate::machine::Machine;

/// Inclination by which two attitudes scatter over a window (rad).
const SCATTER: f64 = 0.01;
const TILTS: Mixture = Mixture {
    outliers: 0.05,
    range: 0.5,
};

/// The relation.
#[derive(Debug, Clone)]
pub(super) struct TiltRelation {
    /// Sums of the up directions in base axes, and their numbers.
    imu: (Vector3<f64>, f64),
    odometry: (Vector3<f64>, f64),
    hypotheses: Hypotheses,
}

impl TiltRelation {
    pub(super) fn new(machine: &Machine, threshold: f64) -> Self {
        let mounted = machine.plausibility().tilt_tolerance / 3.0;
        Self {
            imu: (Vector3::zeros(), 0.0),
            odometry: (Vector3::zeros(), 0.0),
            hypotheses: Hypotheses::new(TILTS, mounted, Vec::new(), threshold),
        }
    }

    /// Takes the up direction by the IMU (base axes).
    pub(super) fn take_imu(&mut self, up: &Vector3<f64>) {
        self.imu.0 += up;
        self.imu.1 += 1.0;
    }

    /// Takes the attitude of the odometry, unit quaternion x y z w.
    pub(super) fn take_odometry(&mut self, xyzw: &[f64]) {
        if let Some(up) = up_direction(xyzw) {
            self.odometry.0 += up;
            self.odometry.1 += 1.0;
        }
    }

    /// Weighs the window that began at `start_ns`.
    pub(super) fn weigh(&mut self, start_ns: i64) {
        let [imu, odometry] = [&mut self.imu, &mut self.odometry]
            .map(|sum| std::mem::replace(sum, (Vector3::zeros(), 0.0)));
        if imu.1 == 0.0 || odometry.1 == 0.0 {
            self.hypotheses.forget();
            return;
        }
        let compared = Compared {
            start_ns,
            measured: imu.0 / imu.1,
            sigma: Vector3::repeat(SCATTER),
            drift: 0.0,
            per_offset: 1.0,
        };
        self.hypotheses
            .weigh(&compared, |_| odometry.0 / odometry.1);
    }

    /// Whether an alternative, with this prior probability, is now more likely than sound sensors.
    pub(super) fn is_disputed(&self, beforehand: f64) -> bool {
        self.hypotheses.is_disputed(beforehand)
    }

    pub(super) fn standing(&self) -> Standing {
        self.hypotheses.standing()
    }
}
