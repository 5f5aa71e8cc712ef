//! Joints that an actuator of known force turns, with some of the wheels beyond them.

use super::{Contact, LinkageSpec, Machine, MachineSpec};

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
    /// Index of the joint among the [`actuated`](Contact::actuated_joints) ones.
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

impl Contact {
    /// Every joint whose torque enters an equation: the free ones, then pivot, cylinder and rod of each
    /// actuated one.
    pub(crate) fn torque_joints(&self) -> impl Iterator<Item = &TorqueJoint> {
        let steps = self.actuated_joints.iter().flat_map(|joint| &joint.steps);
        self.free_joints.iter().chain(steps)
    }

    /// The signals of those actuated joints whose force a log or a live system has, in the order in which
    /// its sensors have them.
    #[must_use]
    pub fn actuator_signals(&self, is_there: impl Fn(usize) -> bool) -> Vec<ActuatorSignal> {
        let joints = self.actuated_joints.iter().enumerate();
        let there = joints.filter(|(joint, _)| is_there(*joint));
        let signals = there.flat_map(|(joint, spec)| {
            (0..spec.signals.len()).map(move |signal| ActuatorSignal { joint, signal })
        });
        signals.collect()
    }

    /// Where a step of an actuated joint stands among [`Contact::torque_joints`].
    pub(crate) fn torque_place(&self, actuated: usize, step: usize) -> usize {
        self.free_joints.len() + 3 * actuated + step
    }
}

/// How far a load may be off what the split rule says before anything is measured, as a share of the
/// mean load: on uneven ground a stiff frame moves that much from one diagonal to the other.
const WARP_SHARE: f64 = 0.5;

impl Machine {
    /// Standard deviation of each wheel's share in the warp before it is measured (N): half the mean
    /// load; on ground that is declared a plane no more than the stated uncertainty of the wheels'
    /// height makes of it.
    pub(crate) fn warp_sigma(&self) -> f64 {
        let unknown = WARP_SHARE * self.mass() * self.gravity / self.wheels.len() as f64;
        // four heights, each sigma off, press one diagonal by half a height at each wheel
        let by_heights = |stiffness: f64| 0.5 * stiffness * self.uncertainty.wheel_position;
        (self.contact.mean_stiffness)
            .map_or(unknown, |stiffness| by_heights(stiffness).min(unknown))
    }
}
