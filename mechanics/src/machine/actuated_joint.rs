//! Joints that an actuator of known force turns, with some of the wheels in their distal subtree.

use super::{Contact, LinkageSpec, Machine, MachineSpec};
use crate::signal::ActuatorSignal;

/// A joint whose torque enters an equation of the loads.
#[derive(Debug, Clone)]
pub struct TorqueJoint {
    /// The body moved by the joint.
    pub body: usize,
    /// Whether the joint supports each body, that is, whether it is in the distal subtree.
    pub carries_body: Vec<bool>,
    /// Whether each wheel is in the distal subtree.
    pub carries_wheel: Vec<bool>,
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

impl Contact {
    /// Every joint whose torque enters an equation: the free ones, then pivot, cylinder and rod of each
    /// actuated one.
    pub(crate) fn torque_joints(&self) -> impl Iterator<Item = &TorqueJoint> {
        let steps = self.actuated_joints.iter().flat_map(|joint| &joint.steps);
        self.free_joints.iter().chain(steps)
    }

    /// The signals of those actuated joints whose force the log or live system provides, in the order of its
    /// sensors.
    #[must_use]
    pub fn actuator_signals(&self, is_there: impl Fn(usize) -> bool) -> Vec<ActuatorSignal> {
        let joints = self.actuated_joints.iter().enumerate();
        let there = joints.filter(|(joint, _)| is_there(*joint));
        let signals = there.flat_map(|(joint, spec)| {
            (0..spec.signals.len()).map(move |signal| ActuatorSignal { joint, signal })
        });
        signals.collect()
    }

    /// Index of a joint of an actuated linkage in [`Contact::torque_joints`].
    pub(crate) fn torque_place(&self, actuated: usize, step: usize) -> usize {
        self.free_joints.len() + 3 * actuated + step
    }
}

/// Prior standard deviation of a load from the split rule before any measurement, as a fraction of the mean
/// load: on uneven ground a stiff frame shifts that much from one diagonal to the other.
const WARP_SHARE: f64 = 0.5;

impl Machine {
    /// Prior standard deviation of each wheel's share of the warp (N): half the mean load; on ground declared
    /// flat, at most what the stated uncertainty of the wheels' heights causes.
    pub(crate) fn warp_sigma(&self) -> f64 {
        let unknown = WARP_SHARE * self.mass() * self.gravity / self.wheels.len() as f64;
        // Four heights, each off by sigma, deflect each wheel of one diagonal by half a height.
        let by_heights = |stiffness: f64| 0.5 * stiffness * self.uncertainty.wheel_position;
        (self.contact.mean_stiffness)
            .map_or(unknown, |stiffness| by_heights(stiffness).min(unknown))
    }
}
