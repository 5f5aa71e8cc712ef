//! Contact between wheels and ground.

use super::actuated_joint::{ActuatedJoint, ActuatorSignal, TorqueJoint};
use super::spec::Ground;
use super::split::Split;
use super::warp::{Warp, exchange, mean_stiffness};
use super::wheel::Wheel;

/// Contact between wheels and ground.
#[derive(Debug, Clone)]
pub struct Contact {
    /// The rule for the load split that equilibrium leaves open.
    pub split: Split,
    /// Joints that carry no torque.
    pub free_joints: Vec<TorqueJoint>,
    /// Joints whose torque may be logged.
    pub actuated_joints: Vec<ActuatedJoint>,
    /// Standard deviation of a distal wheel's traction from its proportional share, as a fraction of its load,
    /// for such joints.
    pub traction_share: f64,
    /// Whether the unloaded radii of the wheels differ.
    pub radii_differ: bool,
    /// Whether the tyres' stiffness is known, so that their deflection is included.
    pub tyres_deflect: bool,
    /// The shape of the ground that the machine file declares.
    pub ground: Ground,
    /// Mean stiffness of the tyres (N/m), if the ground is flat and the stiffness known: then the wheels' heights
    /// off a common plane deflect the tyres.
    pub mean_stiffness: Option<f64>,
    /// Effect of such heights under the split rule by roll moment distribution.
    pub warp: Option<Warp>,
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

    /// Index of a joint of an actuated linkage in [`Contact::torque_joints`]. Supports of measured load, which have no
    /// joints, come after the linkages.
    pub(crate) fn torque_place(&self, actuated: usize, step: usize) -> usize {
        self.free_joints.len() + 3 * actuated + step
    }
}

impl Contact {
    /// Sets the quantities derived from the wheels' stiffness on flat ground. Under the split rule by roll moment
    /// distribution, z are the self-equilibrated loads with all joints at zero; heights u of the wheels below
    /// the plane then give the loads z (z.u) / (z' K^-1 z).
    pub(super) fn set_warp(&mut self, wheels: &[Wheel]) {
        if self.ground != Ground::Plane || !self.tyres_deflect {
            return;
        }
        self.mean_stiffness = Some(mean_stiffness(wheels));
        if let Split::RollMomentDistribution {
            share,
            wheels: four,
        } = self.split
        {
            let places = four.map(|wheel| wheels[wheel].centre_at_zero.xy());
            let mut by_wheel = vec![0.0; wheels.len()];
            for (&wheel, &load) in four.iter().zip(&exchange(share, &places)) {
                by_wheel[wheel] = load;
            }
            self.warp = Some(Warp::of(by_wheel, wheels));
        }
    }

    /// Updates mean stiffness and warp for another tyre stiffness; z stays the same.
    pub(super) fn renew_warp(&mut self, wheels: &[Wheel]) {
        self.mean_stiffness = self.mean_stiffness.map(|_| mean_stiffness(wheels));
        let exchange = self.warp.take().map(|warp| warp.exchange);
        self.warp = exchange.map(|exchange| Warp::of(exchange, wheels));
    }
}
