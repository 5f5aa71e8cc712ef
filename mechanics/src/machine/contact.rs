//! How the ground carries the wheels.

use super::actuated_joint::{ActuatedJoint, ActuatorSignal, TorqueJoint};
use super::spec::Ground;
use super::split::Split;
use super::warp::{Warp, exchange, mean_stiffness};
use super::wheel::Wheel;

/// How the ground carries the wheels.
#[derive(Debug, Clone)]
pub struct Contact {
    /// The rule that splits what equilibrium leaves open.
    pub split: Split,
    /// Joints that carry no torque.
    pub free_joints: Vec<TorqueJoint>,
    /// Joints whose torque a log may tell.
    pub actuated_joints: Vec<ActuatedJoint>,
    /// Traction of a wheel beyond such a joint that is not its share of the whole, one standard deviation
    /// as a share of its load.
    pub traction_share: f64,
    /// Whether the wheels' radii differ without load.
    pub radii_differ: bool,
    /// Whether the tyres' stiffness is known, so that their deflection is.
    pub tyres_deflect: bool,
    /// Whether the machine file declares the ground a plane.
    pub ground: Ground,
    /// Mean stiffness of the tyres (N/m), where the ground is a plane and they are known: then heights
    /// of the wheels off one plane press them.
    pub mean_stiffness: Option<f64>,
    /// What such heights do under the front share's rule.
    pub warp: Option<Warp>,
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

impl Contact {
    /// Sets what follows from the wheels' stiffness on plane ground. Under the front share's rule the
    /// loads in equilibrium with themselves, z, are those with all joints at zero; a height u of each
    /// wheel below the plane then gives z (z.u) / (z' K^-1 z).
    pub(super) fn set_warp(&mut self, wheels: &[Wheel]) {
        if self.ground != Ground::Plane || !self.tyres_deflect {
            return;
        }
        self.mean_stiffness = Some(mean_stiffness(wheels));
        if let Split::FrontShare {
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

    /// Sets the same again for tyres of another stiffness; where z is stays as it was.
    pub(super) fn renew_warp(&mut self, wheels: &[Wheel]) {
        self.mean_stiffness = self.mean_stiffness.map(|_| mean_stiffness(wheels));
        let exchange = self.warp.take().map(|warp| warp.exchange);
        self.warp = exchange.map(|exchange| Warp::of(exchange, wheels));
    }
}
