//! Bounds of a machine's motion between the rows of a sparse log.

use super::checked::Machine;

/// Greatest velocity and acceleration of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointBounds {
    /// Greatest velocity (rad/s or m/s).
    pub rate: f64,
    /// Greatest acceleration (rad/s^2 or m/s^2).
    pub acceleration: f64,
}

impl Machine {
    /// Whether a row without neighbouring samples counts as static, and not as invalid.
    #[must_use]
    pub fn is_quasi_static(&self) -> bool {
        self.is_quasi_static
    }

    /// Makes rows without neighbours static, or invalid again.
    pub fn set_quasi_static(&mut self, is_quasi_static: bool) {
        self.is_quasi_static = is_quasi_static;
    }

    /// The longest gap between two samples in which something is known of the loads (ns).
    #[must_use]
    pub fn longest_known_gap_ns(&self) -> i64 {
        let longest_s = match self.is_quasi_static {
            true => self.estimator.max_gap.max(self.quasi_static.hold),
            false => self.estimator.max_gap,
        };
        (longest_s * 1e9) as i64
    }

    /// Greatest velocity and acceleration of a joint: those stated for it, else the velocity limit of the URDF and
    /// the values of its kind. A wheel accelerates with the platform.
    #[must_use]
    pub fn joint_bounds(&self, joint: usize) -> JointBounds {
        let (spec, measured) = (&self.quasi_static, &self.joints[joint]);
        let stated = spec.joints.get(&measured.name).copied().unwrap_or_default();
        let (rate, acceleration) = match (measured.spins_wheel, self.joint_slides(joint)) {
            (Some(wheel), _) => (
                self.plausibility.wheel_rate_max,
                spec.platform_acceleration / self.wheels[wheel].radius,
            ),
            (None, true) => (spec.joint_rate_linear, spec.joint_acceleration_linear),
            (None, false) => (spec.joint_rate, spec.joint_acceleration),
        };
        JointBounds {
            rate: stated.rate.or(measured.max_velocity).unwrap_or(rate),
            acceleration: stated.acceleration.unwrap_or(acceleration),
        }
    }
}
