//! Joints that steer wheels, and machines that turn without any.

use nalgebra::Matrix3;

use super::body::{JointCoupling, JointKind};
use super::checked::Machine;
use super::wheel::Wheel;

/// Largest vertical part of the axis of a joint that does not steer.
const STEERS: f64 = 0.7;

impl Machine {
    /// Whether a joint turns this body of a wheel about the vertical: one between base and body, other than the wheel's spin
    /// joint.
    pub(crate) fn is_steered(&self, wheel_body: usize) -> bool {
        is_steered(self, wheel_body, wheel_body)
    }

    /// Whether a joint steers a wheel: the joint turns the wheel about the vertical, and neither spins nor lifts it.
    #[must_use]
    pub fn is_steering(&self, joint: usize) -> bool {
        let is_moved = |body: usize| matches!(self.bodies[body].coupling, JointCoupling::Measured(j) if j == joint);
        let is_above = |wheel: &Wheel| {
            let mut body = wheel.body;
            while body != 0 && !is_moved(body) {
                body = self.bodies[body].parent;
            }
            body != 0 && body != wheel.body && is_steered(self, wheel.body, body)
        };
        self.wheels().iter().any(is_above)
    }

    /// Whether the machine turns by the speeds of its wheels, which slip sideways: no wheel of it is steered.
    pub(crate) fn skids(&self) -> bool {
        let spins = |body: usize| match self.bodies[body].coupling {
            JointCoupling::Measured(joint) => self.joints()[joint].spins_wheel.is_some(),
            _ => false,
        };
        // A wheel that does not turn by itself may be fixed to the part that steers it.
        let steers =
            |body: usize| is_steered(self, if spins(body) { body } else { usize::MAX }, body);
        !self.wheels().iter().any(|wheel| steers(wheel.body))
    }
}

/// Whether a joint between the base and this carrier of a wheel, other than that of the `spinning` body, turns it about the
/// vertical.
fn is_steered(machine: &Machine, spinning: usize, carrier: usize) -> bool {
    let mut chain = vec![carrier];
    while let Some(&body) = chain.last()
        && body != 0
    {
        chain.push(machine.bodies[body].parent);
    }
    let mut rotation = Matrix3::<f64>::identity();
    let mut steps = chain
        .into_iter()
        .rev()
        .filter(|&body| body != 0 && body != spinning);
    steps.any(|index| {
        let body = &machine.bodies[index];
        rotation *= body.parent_from_joint;
        let is_measured = matches!(body.coupling, JointCoupling::Measured(_));
        is_measured && body.kind == JointKind::Revolute && rotation[(2, 2)].abs() > STEERS
    })
}
