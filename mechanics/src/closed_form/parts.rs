//! Assignment of a machine's parts to platform, wheels and arm.

use nalgebra::Vector3;

use super::ClosedFormError;
use crate::machine::{Inertia, LinkGroup, Machine, MassMoments, Split};

/// The parts of a machine in the analytic model: a platform of everything other than arm and wheels, four
/// wheels, and the attachment point of the arm.
#[derive(Debug, Clone)]
pub struct PlatformParts {
    /// The bodies that contribute to the platform and their contributions, in the body's frame; wheels and arm,
    /// which the model treats separately, are excluded.
    pub(super) chassis: Vec<(usize, MassMoments)>,
    /// Indices of the wheels, by [`Corner`](super::Corner).
    pub(super) wheels: [usize; 4],
    pub(super) roll_moment_distribution: f64,
    /// Body and point in it at which the arm is attached.
    pub(super) arm_base: Option<(usize, Vector3<f64>)>,
}

impl PlatformParts {
    /// The parts of `machine`. Bogies, their cylinders and rods, steering knuckles and permanent payloads on any
    /// of these belong to the platform; a wheel's body is the wheel.
    ///
    /// # Errors
    /// [`ClosedFormError`]: the machine does not have four wheels with a roll moment distribution.
    pub fn of(machine: &Machine) -> Result<Self, ClosedFormError> {
        let found = machine.wheels.len();
        if found != 4 {
            return Err(ClosedFormError::Wheels { found });
        }
        let found = machine.contact.free_joints.len();
        if found != 0 {
            return Err(ClosedFormError::FreeJoints { found });
        }
        let Split::RollMomentDistribution { share, wheels } = machine.contact.split else {
            return Err(ClosedFormError::Split);
        };
        check_wheels_move(machine)?;
        let chassis = chassis_by_body(machine);
        if !(chassis.iter().map(|(_, part)| part.mass).sum::<f64>() > 0.0) {
            return Err(ClosedFormError::NoMass);
        }
        let [front_left, front_right, rear_left, rear_right] = wheels;
        Ok(Self {
            chassis,
            wheels: [front_left, front_right, rear_right, rear_left],
            roll_moment_distribution: share,
            arm_base: arm_base(machine),
        })
    }

    /// Indices of the wheels in [`Machine::wheels`], by [`Corner`](super::Corner).
    #[must_use]
    pub fn wheels(&self) -> [usize; 4] {
        self.wheels
    }
}

/// A wheel that is part of the root, or of another wheel's body, has no separate mass.
fn check_wheels_move(machine: &Machine) -> Result<(), ClosedFormError> {
    for wheel in &machine.wheels {
        let sharing = machine.wheels.iter().filter(|w| w.body == wheel.body);
        if wheel.body == 0 || sharing.count() > 1 {
            let wheel = wheel.name.clone();
            return Err(ClosedFormError::WeldedWheel { wheel });
        }
    }
    Ok(())
}

/// Contribution of each body to the platform: its links outside the arm, and permanent payloads on a body with
/// such links; wheels are excluded.
fn chassis_by_body(machine: &Machine) -> Vec<(usize, MassMoments)> {
    let mut chassis = vec![Inertia::zero(); machine.bodies.len()];
    let mut counts = vec![false; machine.bodies.len()];
    for link in machine
        .links
        .iter()
        .filter(|l| l.group == LinkGroup::Chassis)
    {
        chassis[link.body] = chassis[link.body].welded(&link.inertia);
        counts[link.body] = true;
    }
    for payload in machine.payloads.iter().filter(|p| p.is_always()) {
        if counts[payload.body] {
            chassis[payload.body] = chassis[payload.body].welded(&payload.inertia);
        }
    }
    let massive = chassis
        .iter()
        .enumerate()
        .filter(|(_, part)| part.mass > 0.0);
    massive
        .map(|(body, part)| (body, MassMoments::from(part)))
        .collect()
}

/// Attachment point of the arm: the joint of its root link, or that link's origin if it is rigidly connected to
/// the platform. Links are sorted parents first, so the root link is the arm's first.
fn arm_base(machine: &Machine) -> Option<(usize, Vector3<f64>)> {
    let root = machine
        .links
        .iter()
        .find(|link| link.group == LinkGroup::Arm)?;
    let body = &machine.bodies[root.body];
    let mut mates = machine.links.iter().filter(|l| l.body == root.body);
    if mates.any(|link| link.group != LinkGroup::Arm) || root.body == 0 {
        return Some((root.body, root.body_from_link.translation.vector));
    }
    Some((body.parent, body.joint_in_parent))
}
