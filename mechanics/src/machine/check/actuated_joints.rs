//! Linkages with a bound force whose pivot carries wheels.

use super::checker::Checker;
use crate::machine::{
    ActuatedJoint, ForceSource, Linkage, LinkageSpec, MAX_WHEELS, MachineError, TorqueJoint, Wheel,
};

/// Default standard deviation of the traction from its proportional share.
const TRACTION_SHARE: f64 = 0.1;

impl Checker<'_> {
    /// The distal subtree of the joint of this body: its bodies and wheels.
    pub(super) fn torque_joint(&self, body: usize, wheels: &[Wheel]) -> TorqueJoint {
        let supports_body: Vec<bool> = (0..self.tree.bodies.len())
            .map(|b| self.tree.is_carried_by(b, body))
            .collect();
        TorqueJoint {
            body,
            supports_wheel: wheels.iter().map(|w| supports_body[w.body]).collect(),
            supports_body,
        }
    }

    /// The linkages that determine the load split; `rows` is the number of equations already present.
    pub(super) fn actuated_joints(
        &self,
        linkages: &[Linkage],
        wheels: &[Wheel],
        rows: usize,
    ) -> Result<Vec<ActuatedJoint>, MachineError> {
        let mut joints = Vec::new();
        for (index, (linkage, spec)) in linkages.iter().zip(&self.spec.linkage).enumerate() {
            let signals = ActuatedJoint::bound_signals(self.spec, spec);
            let bodies = &linkage.bodies;
            let steps = [bodies.pivot, bodies.cylinder, bodies.rod]
                .map(|body| self.torque_joint(body, wheels))
                .to_vec();
            let carried = &steps[0].supports_wheel;
            if signals.is_empty() || carried.iter().all(|&c| c) || carried.iter().all(|&c| !c) {
                continue;
            }
            let free = self.spec.contact.free_joints.iter();
            if free.clone().any(|name| *name == spec.pivot) {
                return Err(self.value_error(
                    "contact.free_joints",
                    format!(
                        "joints without an actuator of known force (linkage {})",
                        spec.name
                    ),
                    format!("\"{}\"", spec.pivot),
                ));
            }
            self.check_force_errors(spec)?;
            joints.push(ActuatedJoint {
                source: ForceSource::Linkage(index),
                steps,
                signals,
                force_sigma: spec.force_sigma,
                friction_share: spec.friction_share,
            });
        }
        if rows + joints.len() > MAX_WHEELS {
            let expected = format!(
                "force or pressure of at most {} linkages that carry wheels",
                MAX_WHEELS - rows
            );
            return Err(self.value_error("linkage", expected, joints.len()));
        }
        Ok(joints)
    }

    /// Checks the stated errors of a linkage's force.
    pub(super) fn check_force_errors(&self, spec: &LinkageSpec) -> Result<(), MachineError> {
        for (key, value) in [
            ("force_sigma", spec.force_sigma),
            ("friction_share", spec.friction_share),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                let place = format!("linkage.{}.{key}", spec.name);
                return Err(self.value_error(place, "a number that is not negative", value));
            }
        }
        Ok(())
    }

    pub(super) fn traction_share(&self) -> Result<f64, MachineError> {
        let share = self.spec.contact.traction_share.unwrap_or(TRACTION_SHARE);
        if !(share.is_finite() && share >= 0.0) {
            return Err(self.value_error(
                "contact.traction_share",
                "a number that is not negative",
                share,
            ));
        }
        Ok(share)
    }
}
