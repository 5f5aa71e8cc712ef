//! Joints that an actuator of known force turns, with some of the wheels beyond them.

use super::spec::{LinkageSpec, MachineSpec};

/// A joint whose torque enters an equation of the loads.
#[derive(Debug, Clone)]
pub struct TorqueJoint {
    /// The body that the joint carries.
    pub body: usize,
    /// Whether each body is this one or beyond it.
    pub carries_body: Vec<bool>,
    /// Whether each wheel is beyond the joint.
    pub carries_wheel: Vec<bool>,
}

/// The pivot of a linkage whose actuator's force a log may tell, with some but not all wheels beyond it.
#[derive(Debug, Clone)]
pub struct ActuatedJoint {
    /// Index of the linkage.
    pub linkage: usize,
    /// Its pivot, its cylinder's hinge, its rod.
    pub steps: [TorqueJoint; 3],
    /// The signals that make the force, N = sum of factor times signal: 1 for a force, the areas of
    /// piston and ring (m^2, the latter negative) for the pressures in the chambers.
    pub signals: Vec<f64>,
    /// Standard deviation of one sample of the force (N).
    pub force_sigma: f64,
    /// Standard deviation of the friction in the cylinder, as a share of the force.
    pub friction_share: f64,
}

/// A signal of an actuator's force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActuatorSignal {
    /// Index of the joint among the [`actuated`](super::Contact::actuated_joints) ones.
    pub joint: usize,
    /// Index among its [`signals`](ActuatedJoint::signals).
    pub signal: usize,
}

impl ActuatedJoint {
    /// The factors of the signals that a linkage's table binds; none where it binds no force.
    pub(super) fn bound_signals(spec: &MachineSpec, linkage: &LinkageSpec) -> Vec<f64> {
        match (spec.force_of(linkage), &linkage.pressure) {
            (Some(_), _) => vec![1.0],
            (None, Some(pressure)) => vec![pressure.piston_area, -pressure.rod_area],
            (None, None) => Vec::new(),
        }
    }
}
