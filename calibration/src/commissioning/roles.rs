//! Role of each joint: it spins a wheel, steers wheels, or moves masses.

use tipwatch_mechanics::dynamics::kinematics::RestingBodies;
use tipwatch_mechanics::machine::{JointCoupling, JointKind, Machine};
use tipwatch_mechanics::state::resting_state;

/// Least vertical part of the axis of a steering joint.
const UPRIGHT: f64 = 0.8;

/// Role of a joint in the machine.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Role {
    /// The joint spins this wheel, as the joint of this body.
    Wheel { wheel: usize, body: usize },
    /// The joint turns these wheels about an upright axis; `sign` is +1 if a positive angle turns them to the left.
    Steer { wheels: Vec<usize>, sign: f64 },
    /// The joint moves masses, or the wheels up and down.
    Mass,
    /// The joint's position is constant by the machine file.
    Constant,
}

/// The roles of all joints.
#[derive(Debug, Clone)]
pub(super) struct Roles(Vec<Role>);

impl Roles {
    pub(super) fn new(machine: &Machine) -> Self {
        let state = resting_state(machine, &machine.reference().posture.positions);
        let mut placed = RestingBodies::new(machine);
        placed.place(machine, &state);
        let role = |joint: usize| {
            let measured = &machine.joints()[joint];
            if measured.constant.is_some() {
                return Role::Constant;
            }
            let by = |body: &tipwatch_mechanics::machine::Body| {
                body.coupling == JointCoupling::Measured(joint)
            };
            let Some(body) = machine.bodies().iter().position(by) else {
                return Role::Mass;
            };
            if let Some(wheel) = measured.spins_wheel {
                return Role::Wheel { wheel, body };
            }
            let carried = (0..machine.wheels().len())
                .filter(|&w| machine.is_carried_by(machine.wheels()[w].body, body));
            let wheels: Vec<usize> = carried.collect();
            let axis = placed.motions[body].rotation.column(2).z;
            let steers = machine.bodies()[body].kind == JointKind::Revolute
                && axis.abs() > UPRIGHT
                && !wheels.is_empty()
                && wheels.len() < machine.wheels().len();
            match steers {
                true => Role::Steer {
                    wheels,
                    sign: axis.signum(),
                },
                false => Role::Mass,
            }
        };
        Self((0..machine.joints().len()).map(role).collect())
    }

    pub(super) fn of(&self, joint: usize) -> &Role {
        &self.0[joint]
    }

    /// The joints with a role that this holds for.
    pub(super) fn joints(&self, holds: impl Fn(&Role) -> bool) -> Vec<usize> {
        (0..self.0.len())
            .filter(|&joint| holds(&self.0[joint]))
            .collect()
    }

    /// Whether a wheel is steered.
    pub(super) fn is_steered(&self, wheel: usize) -> bool {
        let steers =
            |role: &Role| matches!(role, Role::Steer { wheels, .. } if wheels.contains(&wheel));
        self.0.iter().any(steers)
    }
}
