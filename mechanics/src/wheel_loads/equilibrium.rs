//! The equations that the loads satisfy, whatever the rule that splits them.

use nalgebra::Vector2;

use crate::contact_plane::ContactPlane;
use crate::kinematics::BodyMotion;
use crate::machine::{FreeJoint, MAX_WHEELS, Machine, Split};
use crate::newton_euler;
use crate::number::Real;
use crate::spatial::Wrench;

/// The wrench of the ground in the contact plane's axes, moments about the projection of the base
/// frame's origin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GroundForce<T> {
    /// Along the normal (N).
    pub(crate) normal: T,
    /// Forward and to the left, in the plane (N).
    pub(crate) tangential: Vector2<T>,
    /// About the forward and the left axis (N m).
    pub(crate) moment: Vector2<T>,
}

impl<T: Real> GroundForce<T> {
    /// From the wrench about the base origin, base axes.
    pub(crate) fn in_plane(wrench: &Wrench<T>, plane: &ContactPlane<T>) -> Self {
        let projected = wrench.about(&(plane.normal * plane.height));
        Self {
            normal: plane.normal.dot(&wrench.force),
            tangential: Vector2::new(
                plane.forward.dot(&wrench.force),
                plane.left.dot(&wrench.force),
            ),
            moment: Vector2::new(
                plane.forward.dot(&projected.moment),
                plane.left.dot(&projected.moment),
            ),
        }
    }

    /// Where the normal force acts as one: x = -M_y / F_n, y = M_x / F_n (m).
    pub(crate) fn centre_of_pressure(&self) -> Vector2<T> {
        Vector2::new(-self.moment.y / self.normal, self.moment.x / self.normal)
    }
}

/// `sum over wheels of factor[row][wheel] * load = value[row]`. The first [`Equations::certain`] rows
/// always hold; after them stands the split rule, if it is an equation.
#[derive(Debug)]
pub(crate) struct Equations<T> {
    pub(crate) factor: Vec<[T; MAX_WHEELS]>,
    pub(crate) value: Vec<T>,
    pub(crate) wheels: usize,
    pub(crate) certain: usize,
}

impl<T: Real> Equations<T> {
    pub(crate) fn new(machine: &Machine) -> Self {
        let certain = 3 + machine.contact.free_joints.len();
        let rows = certain + usize::from(machine.contact.split != Split::Springs);
        let mut equations = Self {
            factor: vec![[T::zero(); MAX_WHEELS]; rows],
            value: vec![T::zero(); rows],
            wheels: machine.wheels.len(),
            certain,
        };
        equations.factor[0] = [T::one(); MAX_WHEELS];
        if let Split::FrontShare {
            share,
            wheels: [fl, fr, rl, rr],
        } = machine.contact.split
        {
            // (54): FR - FL = D (FR + RR - FL - RL)
            let row = &mut equations.factor[certain];
            row[fr] = T::constant(1.0 - share);
            row[fl] = T::constant(share - 1.0);
            row[rr] = T::constant(-share);
            row[rl] = T::constant(share);
        }
        equations
    }

    /// Force along the normal and moments in the plane of the contact points.
    pub(crate) fn set_equilibrium(&mut self, ground: &GroundForce<T>, contacts: &[Vector2<T>]) {
        for (wheel, contact) in contacts.iter().enumerate() {
            self.factor[1][wheel] = contact.y;
            self.factor[2][wheel] = -contact.x;
        }
        self.value[0] = ground.normal;
        self.value[1] = ground.moment.x;
        self.value[2] = ground.moment.y;
    }

    /// The moment about the axis of each joint without torque, of all that is beyond it. The traction
    /// of a wheel is taken as its load's share of the whole, along t = F_tangential / F_n:
    /// ```text
    ///     sum over wheels beyond of z . (r_i - p) x (n + t) N_i = z . (M - p x F)
    /// ```
    /// with F, M the wrench that moves the bodies beyond, about the base origin.
    pub(crate) fn set_free_joints(&mut self, machine: &Machine, beyond: &Beyond<'_, T>) {
        for (k, joint) in machine.contact.free_joints.iter().enumerate() {
            let motion = &beyond.motions[joint.body];
            let axis = motion.rotation.column(2).into_owned();
            let wrench = beyond.wrench(machine, joint).about(&motion.origin);
            for (wheel, spec) in machine.wheels.iter().enumerate() {
                let centre = beyond.motions[spec.body].point(&spec.centre_in_body);
                let contact = centre - beyond.plane.normal * beyond.radii[wheel] - motion.origin;
                let factor = axis.dot(&contact.cross(&beyond.force_per_load));
                self.factor[3 + k][wheel] = if joint.carries_wheel[wheel] {
                    factor
                } else {
                    T::zero()
                };
            }
            self.value[3 + k] = axis.dot(&wrench.moment);
        }
    }
}

/// What the equations of free joints need of the bodies beyond them.
pub(crate) struct Beyond<'a, T: Real> {
    pub(crate) motions: &'a [BodyMotion<T>],
    pub(crate) wrenches: &'a [Wrench<T>],
    pub(crate) tool_wrench: &'a Wrench<T>,
    pub(crate) plane: &'a ContactPlane<T>,
    /// Distance of the wheels' centres from the ground (m).
    pub(crate) radii: &'a [T],
    /// Contact force of a wheel by its load: n + t.
    pub(crate) force_per_load: nalgebra::Vector3<T>,
}

impl<T: Real> Beyond<'_, T> {
    fn wrench(&self, machine: &Machine, joint: &FreeJoint) -> Wrench<T> {
        let moved = newton_euler::sum(self.wrenches, |body| joint.carries_body[body]);
        match &machine.tool {
            Some(tool) if joint.carries_body[tool.body] => moved.minus(self.tool_wrench),
            _ => moved,
        }
    }
}
