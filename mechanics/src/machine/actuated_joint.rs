//! Joints that an actuator of known force turns, with some of the wheels in their distal subtree.

use super::spec::{LinkageSpec, MachineSpec};

/// A joint whose torque enters an equation of the loads.
#[derive(Debug, Clone)]
pub struct TorqueJoint {
    /// The body moved by the joint.
    pub body: usize,
    /// Whether the joint supports each body, that is, whether it is in the distal subtree.
    pub supports_body: Vec<bool>,
    /// Whether each wheel is in the distal subtree.
    pub supports_wheel: Vec<bool>,
}

/// The pivot of a linkage whose actuator force may be logged, with some but not all wheels in its distal
/// subtree.
#[derive(Debug, Clone)]
pub struct ActuatedJoint {
    /// Index of the linkage.
    pub linkage: usize,
    /// Its pivot, its cylinder's hinge, its rod.
    pub steps: [TorqueJoint; 3],
    /// Coefficients of the signals in the force, N = sum of coefficient times signal: 1 for a force, the areas of
    /// piston and annulus (m^2, the latter negative) for the chamber pressures.
    pub signals: Vec<f64>,
    /// Standard deviation of one sample of the force (N).
    pub force_sigma: f64,
    /// Standard deviation of the friction in the cylinder, as a fraction of the force.
    pub friction_share: f64,
}

/// A signal of an actuated joint's force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActuatorSignal {
    /// Index of the joint in [`actuated_joints`](super::Contact::actuated_joints).
    pub joint: usize,
    /// Index in its [`signals`](ActuatedJoint::signals).
    pub signal: usize,
}

impl ActuatedJoint {
    /// Coefficients of the signals bound in a linkage's table; empty if it binds no force.
    pub(super) fn bound_signals(spec: &MachineSpec, linkage: &LinkageSpec) -> Vec<f64> {
        match (spec.force_of(linkage), &linkage.pressure) {
            (Some(_), _) => vec![1.0],
            (None, Some(pressure)) => vec![pressure.piston_area, -pressure.rod_area],
            (None, None) => Vec::new(),
        }
    }
}
