//! The equations that the loads satisfy, whatever the rule that splits them.

use nalgebra::{Vector2, Vector3};

use crate::contact_plane::ContactPlane;
use crate::kinematics::BodyMotion;
use crate::machine::{MAX_WHEELS, Machine, Split};
use crate::newton_euler;
use crate::number::Real;
use crate::spatial::Wrench;

/// The wrench of the ground in the contact plane's axes, moments about the projection of the base
/// frame's origin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GroundForce<T> {
    /// Along the normal (N).
    pub(crate) normal: T,
    /// About the forward and the left axis (N m).
    pub(crate) moment: Vector2<T>,
}

impl<T: Real> GroundForce<T> {
    /// From the wrench about the base origin, base axes.
    pub(crate) fn in_plane(wrench: &Wrench<T>, plane: &ContactPlane<T>) -> Self {
        let projected = wrench.about(&(plane.normal * plane.height));
        Self {
            normal: plane.normal.dot(&wrench.force),
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
    /// How far each tyre is pressed in before the machine leans, in units of load by relative
    /// stiffness: u of N = K (u + A' l). Zero but on springs on plane ground.
    pub(crate) offset: [T; MAX_WHEELS],
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
            offset: [T::zero(); MAX_WHEELS],
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

    /// Heights of the wheels off the plane, where the ground is one: u = k (R_0 + h - n.c) is how far
    /// the ground would press a tyre of unloaded radius R_0. On springs they are offsets, under the
    /// front share's rule the value of its equation.
    pub(crate) fn set_offsets(
        &mut self,
        machine: &Machine,
        plane: &ContactPlane<T>,
        centres: &[Vector3<T>],
    ) {
        let Some(stiffness) = machine.contact.mean_stiffness else {
            return;
        };
        let mut by_rule = T::zero();
        for (wheel, centre) in centres.iter().enumerate() {
            let radius = T::constant(machine.wheels[wheel].radius);
            let pressed = radius + plane.height - plane.normal.dot(centre);
            let offset = pressed * T::constant(stiffness);
            match &machine.contact.warp {
                Some(warp) => by_rule += offset * T::constant(warp.value_by_offset[wheel]),
                None => self.offset[wheel] = offset,
            }
        }
        if machine.contact.warp.is_some() {
            self.value[self.certain] = by_rule;
        }
    }

    /// The moment about the axis of each joint without torque, of all that is beyond it. The traction
    /// of a wheel is taken as its load's share of the whole, so that its force is q = F / F_n by load:
    /// ```text
    ///     sum over wheels beyond of z . (r_i - p) x q N_i = z . (M_b - p x F_b)
    /// ```
    /// with F_b, M_b the wrench that moves the bodies beyond, about the base origin.
    pub(crate) fn set_free_joints(&mut self, machine: &Machine, beyond: &Beyond<'_, T>) {
        let rows = self.factor[3..].iter_mut().zip(&mut self.value[3..]);
        let joints = machine.contact.free_joints.iter().zip(beyond.wrenches);
        for ((factor, value), (joint, wrench)) in rows.zip(joints) {
            let motion = &beyond.motions[joint.body];
            let axis = motion.rotation.column(2).into_owned();
            for (wheel, factor) in factor[..self.wheels].iter_mut().enumerate() {
                let contact = beyond.centres[wheel]
                    - beyond.plane.normal * beyond.radii[wheel]
                    - motion.origin;
                *factor = if joint.carries_wheel[wheel] {
                    axis.dot(&contact.cross(&beyond.force_per_load))
                } else {
                    T::zero()
                };
            }
            *value = axis.dot(&wrench.about(&motion.origin).moment);
        }
    }
}

/// What the equations of free joints need of the bodies beyond them.
pub(crate) struct Beyond<'a, T: Real> {
    pub(crate) motions: &'a [BodyMotion<T>],
    /// Wrench of the bodies beyond each free joint, less that on the tool if it is beyond.
    pub(crate) wrenches: &'a [Wrench<T>],
    pub(crate) plane: &'a ContactPlane<T>,
    pub(crate) centres: &'a [Vector3<T>],
    /// Distance of the wheels' centres from the ground (m).
    pub(crate) radii: &'a [T],
    /// Contact force of a wheel by its load: q.
    pub(crate) force_per_load: Vector3<T>,
}

/// The wrenches beyond the free joints, less that on the tool where it is beyond.
pub(crate) fn beyond_free_joints<T: Real>(
    machine: &Machine,
    wrenches: &[Wrench<T>],
    tool_wrench: &Wrench<T>,
    beyond: &mut [Wrench<T>],
) {
    for (joint, beyond) in machine.contact.free_joints.iter().zip(beyond) {
        let moved = newton_euler::sum(wrenches, |body| joint.carries_body[body]);
        *beyond = match &machine.tool {
            Some(tool) if joint.carries_body[tool.body] => moved.minus(tool_wrench),
            _ => moved,
        };
    }
}
