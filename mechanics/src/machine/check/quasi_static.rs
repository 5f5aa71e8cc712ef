//! Checks `[quasi_static]`.

use super::checker::Checker;
use crate::machine::{MachineError, MeasuredJoint};

impl Checker<'_> {
    /// Checks that all numbers are positive and that all joints exist.
    pub(super) fn check_quasi_static(&self, joints: &[MeasuredJoint]) -> Result<(), MachineError> {
        let spec = &self.spec.quasi_static;
        for (key, value) in spec.numbers_by_key() {
            if !(value.is_finite() && value > 0.0) {
                let place = format!("quasi_static.{key}");
                return Err(self.value_error(place, "a positive number", value));
            }
        }
        for name in spec.joints.keys() {
            if !joints.iter().any(|joint| joint.name == *name) {
                let names: Vec<&str> = joints.iter().map(|joint| joint.name.as_str()).collect();
                return Err(self.value_error(
                    "quasi_static.joints",
                    format!("a measured joint: {}", names.join(", ")),
                    format!("\"{name}\""),
                ));
            }
        }
        Ok(())
    }
}
