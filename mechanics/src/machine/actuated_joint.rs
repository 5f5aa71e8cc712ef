//! Joints that an actuator of known force turns, with some of the wheels in their distal subtree.

use super::linkage::Linkage;
use super::spec::{LinkageSpec, MachineSpec};
use super::support_id::SupportId;

/// A joint whose torque enters an equation of the loads.
#[derive(Debug, Clone)]
pub struct TorqueJoint {
    /// The body moved by the joint.
    pub body: usize,
    /// Whether the joint supports each body: whether the body is in the joint's distal subtree.
    pub supports_body: Vec<bool>,
    /// Whether each wheel is in the distal subtree.
    pub supports_wheel: Vec<bool>,
}

/// A measured force that says something about the split of the load: that of the actuator of a linkage whose pivot
/// has some but not all wheels in its distal subtree, or the load of a support itself.
#[derive(Debug, Clone)]
pub struct ActuatedJoint {
    /// The place where the force acts.
    pub source: ForceSource,
    /// The linkage's pivot, its cylinder's hinge, its rod; none for the load of a support.
    pub steps: Vec<TorqueJoint>,
    /// Coefficients of the signals in the force, N = sum of coefficient times signal: 1 for a force, the areas of
    /// piston and annulus (m^2, the latter negative) for the chamber pressures.
    pub signals: Vec<f64>,
    /// Standard deviation of one sample of the force (N).
    pub force_sigma: f64,
    /// Standard deviation of the friction in the cylinder, as a fraction of the force.
    pub friction_share: f64,
}

/// The place where a measured force acts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ForceSource {
    /// In the actuator of the linkage with this index.
    Linkage(usize),
    /// On the support of this name.
    Support {
        /// Its name.
        name: String,
        /// The support.
        support: SupportId,
        /// Its place among the wheels while it is on the ground.
        wheel: Option<usize>,
    },
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
    /// Index of the linkage; `None` for the load of a support.
    #[must_use]
    pub fn linkage(&self) -> Option<usize> {
        match self.source {
            ForceSource::Linkage(linkage) => Some(linkage),
            ForceSource::Support { .. } => None,
        }
    }

    /// Returns the place among the wheels of the support whose load this joint measures; `None` for a linkage, and for a support
    /// that is off the ground.
    #[must_use]
    pub fn support_place(&self) -> Option<usize> {
        match self.source {
            ForceSource::Linkage(_) => None,
            ForceSource::Support { wheel, .. } => wheel,
        }
    }

    /// Name of the linkage or of the support.
    #[must_use]
    pub fn name<'a>(&'a self, linkages: &'a [Linkage]) -> &'a str {
        match &self.source {
            ForceSource::Linkage(linkage) => &linkages[*linkage].name,
            ForceSource::Support { name, .. } => name,
        }
    }

    /// Leaves only these supports on the ground, out of all.
    pub(super) fn stand_on(&mut self, on: &[SupportId]) {
        for step in &mut self.steps {
            let carried = on.iter().map(|s| step.supports_wheel[s.index()]);
            step.supports_wheel = carried.collect();
        }
        if let ForceSource::Support { support, wheel, .. } = &mut self.source {
            *wheel = on.iter().position(|on| on == support);
        }
    }

    /// Coefficients of the signals bound in a linkage's table; empty if it binds no force.
    pub(super) fn bound_signals(spec: &MachineSpec, linkage: &LinkageSpec) -> Vec<f64> {
        match (spec.force_of(linkage), &linkage.pressure) {
            (Some(_), _) => vec![1.0],
            (None, Some(pressure)) => vec![pressure.piston_area, -pressure.rod_area],
            (None, None) => Vec::new(),
        }
    }
}
