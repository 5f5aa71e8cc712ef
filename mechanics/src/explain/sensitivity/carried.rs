//! Wheels and axes of joints with known torque in the distal subtree of each joint, and their motion by it.

use nalgebra::Vector3;

use super::sensed_motion::SensedMotion;
use crate::dynamics::composite::Composite;
use crate::dynamics::newton_euler_derivatives::{JointWrenches, MovingJoint};
use crate::geometry::spatial::{Wrench, cross, each, z_axis};
use crate::machine::Machine;
use crate::number::Real;
use crate::wheel_loads::LoadAdjoint;

/// The wheels and joint axes in the distal subtree of every joint, and how its motion moves them.
#[derive(Debug)]
pub(super) struct Carried<T> {
    /// Wheels carried by each body, with the velocity of their centres.
    wheels: Vec<Vec<(usize, Vector3<T>)>>,
    /// Joints with known torque carried by each body, with the velocity of a point and the change of the direction of their axes.
    axes: Vec<Vec<(usize, [Vector3<T>; 2])>>,
    /// Those of these joints that the body's joint moves as a whole, by body, with the change of the wrench of their distal
    /// subtrees.
    subtrees: Vec<Vec<(usize, JointWrenches<T>)>>,
}

impl<T: Real> Carried<T> {
    pub(super) fn new(machine: &Machine) -> Self {
        let bodies = 0..machine.bodies.len();
        let zero = Vector3::zeros();
        let nothing = JointWrenches {
            position: Wrench::zero(),
            rate: Wrench::zero(),
            acceleration: Wrench::zero(),
        };
        let wheels = |body| {
            let wheels = machine.wheels.iter().enumerate();
            let carried = wheels.filter(|(_, wheel)| machine.is_carried_by(wheel.body, body));
            carried.map(|(wheel, _)| (wheel, zero)).collect()
        };
        let joints = |body| {
            let joints = machine.contact.torque_joints().enumerate();
            joints.filter(move |(_, joint)| machine.is_carried_by(joint.body, body))
        };
        let axes = |body| joints(body).map(|(k, _)| (k, [zero; 2])).collect();
        let subtrees = |body| {
            let moved = joints(body).filter(|(_, joint)| joint.body != body);
            moved.map(|(k, _)| (k, nothing)).collect()
        };
        Self {
            wheels: bodies.clone().map(wheels).collect(),
            axes: bodies.clone().map(axes).collect(),
            subtrees: bodies.map(subtrees).collect(),
        }
    }

    /// Computes the changes with the motion of a body's joint, from the moments and wrenches of the bodies' distal
    /// subtrees.
    #[inline(always)]
    pub(super) fn fill(
        &mut self,
        motion: &SensedMotion<'_, T>,
        body: usize,
        joint: &MovingJoint<T>,
        distal: &[Composite<T>],
        distal_wrenches: &[Wrench<T>],
    ) {
        let field = &joint.field;
        for (wheel, velocity) in &mut self.wheels[body] {
            *velocity = field.at(&motion.centres[*wheel]);
        }
        let contact = &motion.machine.contact;
        for (k, [by_origin, by_axis]) in &mut self.axes[body] {
            let Some(free) = contact.torque_joints().nth(*k) else {
                continue;
            };
            let free = &motion.motions[free.body];
            let axis = z_axis(&free.rotation);
            *by_origin = field.at(&free.origin);
            *by_axis = cross(&field.angular, &axis);
        }
        for (k, wrenches) in &mut self.subtrees[body] {
            let Some(free) = contact.torque_joints().nth(*k) else {
                continue;
            };
            *wrenches = joint.wrenches(&distal[free.body], &distal_wrenches[free.body]);
        }
    }

    /// Derivatives with respect to the position of a body's joint through the wheels and axes in its distal subtree.
    #[inline(always)]
    pub(super) fn by_places(&self, body: usize, adjoint: &LoadAdjoint<T::Wheels>) -> T::Wheels {
        let mut by = T::Wheels::constant(0.0);
        for (wheel, velocity) in &self.wheels[body] {
            by += adjoint.centre[*wheel].dot(&each(velocity));
        }
        for (k, [origin, turned]) in &self.axes[body] {
            let [by_origin, by_axis] = &adjoint.axis[*k];
            by += by_origin.dot(&each(origin)) + by_axis.dot(&each(turned));
        }
        by
    }

    /// The joints with known torque that a body's joint moves as a whole, with the change of the wrench of their
    /// distal subtrees.
    pub(super) fn subtrees(&self, body: usize) -> &[(usize, JointWrenches<T>)] {
        &self.subtrees[body]
    }
}
