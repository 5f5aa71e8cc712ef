//! The equations that the loads satisfy: equilibrium, split rule, free and actuated joints.

use nalgebra::{Vector2, Vector3};

use super::measured_supports::MeasuredSupports;
use crate::dynamics::kinematics::BodyMotion;
use crate::dynamics::newton_euler;
use crate::geometry::contact_plane::ContactPlane;
use crate::geometry::spatial::{Wrench, z_axis};
use crate::machine::{ActuatedJoint, MAX_WHEELS, Machine, Split, TorqueJoint};
use crate::number::Real;

/// The ground wrench in the axes of the contact plane, moments about the projected base origin.
#[derive(Debug, Clone, Copy)]
pub struct GroundForce<T> {
    /// Along the normal (N).
    pub(crate) normal: T,
    /// About the forward and the left axis (N m).
    pub(crate) moment: Vector2<T>,
}

impl<T: Real> GroundForce<T> {
    /// Returns the ground force of a wrench about the base origin, in base axes.
    pub fn in_plane(wrench: &Wrench<T>, plane: &ContactPlane<T>) -> Self {
        let projected = wrench.about(&(plane.normal * plane.height));
        Self {
            normal: plane.normal.dot(&wrench.force),
            moment: Vector2::new(
                plane.forward.dot(&projected.moment),
                plane.left.dot(&projected.moment),
            ),
        }
    }

    /// Returns the ground force in the equations.
    pub(crate) fn of(equations: &Equations<T>) -> Self {
        Self {
            normal: equations.value[0],
            moment: Vector2::new(equations.value[1], equations.value[2]),
        }
    }

    /// The ground wrench with this force in place of the `computed` one.
    pub(crate) fn replacing(
        &self,
        computed: &Self,
        ground: &Wrench<T>,
        plane: &ContactPlane<T>,
    ) -> Wrench<T> {
        let moment = self.moment - computed.moment;
        ground.plus(&Wrench {
            force: plane.normal * (self.normal - computed.normal),
            moment: plane.forward * moment.x + plane.left * moment.y,
        })
    }

    /// Centre of pressure, where the normal force has no moment: x = -M_y / F_n, y = M_x / F_n (m).
    pub(crate) fn centre_of_pressure(&self) -> Vector2<T> {
        Vector2::new(-self.moment.y / self.normal, self.moment.x / self.normal)
    }
}

/// Moment of the ground about the normal through the centre of pressure (N m). Traction in proportion to the loads has none.
pub(crate) fn spin<T: Real>(ground: &Wrench<T>, plane: &ContactPlane<T>) -> T {
    let centre = GroundForce::in_plane(ground, plane).centre_of_pressure();
    let at = plane.normal * plane.height + plane.forward * centre.x + plane.left * centre.y;
    plane.normal.dot(&ground.about(&at).moment)
}

/// `sum over wheels of factor[row][wheel] * load = value[row]`. The first `certain` rows are
/// exact; then the split rule, if it is an equation; then, from `measured` on, one row per
/// joint with measured torque.
#[derive(Debug)]
pub struct Equations<T> {
    pub(crate) factor: Vec<[T; MAX_WHEELS]>,
    pub(crate) value: Vec<T>,
    pub(crate) wheels: usize,
    pub(crate) certain: usize,
    pub(crate) measured: usize,
    /// The wheel whose load each measured row states; `None` for the torque of a linkage.
    pub(super) load_of: Vec<Option<usize>>,
    /// 1 for an active row, 0 for an inactive one.
    pub(crate) holds: Vec<T>,
    /// Compliance of each row: zero for a row that holds exactly.
    pub(crate) compliance: Vec<T>,
    /// Torque of side forces about each joint without torque beside that of traction in proportion to the loads, one standard
    /// deviation (N m): T(14a).
    side_torque: Vec<T>,
    /// Prior standard deviation of the loads from the split rule where torques are measured (N).
    pub(super) prior_scale: f64,
    /// The values that [`Equations::set_measured_aside`] saved: `holds` and `compliance`.
    pub(super) aside: [Vec<T>; 2],
    /// Deflection of each tyre before the machine leans, in units of load by relative stiffness: u of
    /// N = K (u + A' l). Zero except on springs on flat ground.
    pub(crate) offset: [T; MAX_WHEELS],
    /// Whether any of the offsets can differ from zero.
    pub(super) has_offsets: bool,
    /// Measured loads of all supports that replace the computed ground force, and where they do: A(5).
    pub(super) by_supports: MeasuredSupports<T>,
}

impl<T: Real> Equations<T> {
    /// The equations of a machine, without values.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        let certain = 3 + machine.contact.free_joints.len();
        let measured = certain + usize::from(machine.contact.split != Split::Springs);
        let rows = measured + machine.contact.actuated_joints.len();
        let mut equations = Self {
            factor: vec![[T::zero(); MAX_WHEELS]; rows],
            value: vec![T::zero(); rows],
            wheels: machine.wheels.len(),
            certain,
            measured,
            load_of: (machine.contact.actuated_joints.iter())
                .map(ActuatedJoint::support_place)
                .collect(),
            holds: vec![T::one(); rows],
            compliance: vec![T::zero(); rows],
            side_torque: vec![T::zero(); machine.contact.free_joints.len()],
            prior_scale: prior_scale(machine),
            aside: [vec![T::zero(); rows], vec![T::zero(); rows]],
            offset: [T::zero(); MAX_WHEELS],
            has_offsets: machine.contact.mean_stiffness.is_some() && machine.contact.warp.is_none(),
            by_supports: MeasuredSupports::nowhere(),
        };
        equations.forget_measured();
        equations.factor[0] = [T::one(); MAX_WHEELS];
        if let Split::RollMomentDistribution {
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

    /// Sets force along the normal and moments about the axes in the contact plane.
    pub fn set_equilibrium(&mut self, ground: &GroundForce<T>, contacts: &[Vector2<T>]) {
        for (wheel, contact) in contacts.iter().enumerate() {
            self.factor[1][wheel] = contact.y;
            self.factor[2][wheel] = -contact.x;
        }
        self.value[0] = ground.normal;
        self.value[1] = ground.moment.x;
        self.value[2] = ground.moment.y;
    }

    /// Sets the offsets of the wheels from ground declared a plane: u = k (R_0 + h - n.c) is the deflection of
    /// a tyre with unloaded radius R_0. With springs they are offsets, with the split rule by roll moment
    /// distribution they are the value of its equation.
    pub fn set_offsets(
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

    /// Sets the moment about the axis of each joint without torque, of its distal subtree. The traction of a
    /// wheel is assumed proportional to its load, so that its force per load is q = F / F_n:
    /// ```text
    ///     sum over distal wheels of z . (r_i - p) x q N_i = z . (M_b - p x F_b)
    /// ```
    /// where F_b, M_b is the wrench that accelerates the distal subtree, about the base origin. Such traction has no moment about the
    /// normal through the centre of pressure. The moment S that the ground exerts there comes from side forces of the wheels, or
    /// in part from forces along them, which is not known. Side forces alone carry it with
    /// ```text
    ///     s_i = S (x_i - x) / sum (x_j - x)^2,      x: mean of the wheels' places ahead
    ///     s = sum over distal wheels of z . (r_i - p) x left s_i                                        T(14a)
    /// ```
    /// which is the standard deviation of the torque.
    pub(crate) fn set_free_joints(&mut self, machine: &Machine, distal: &DistalSubtrees<'_, T>) {
        let places = || self.factor[2][..self.wheels].iter();
        let mean =
            places().fold(T::zero(), |sum, &behind| sum + behind) / T::constant(self.wheels as f64);
        let squares = places().fold(T::zero(), |sum, &behind| {
            sum + (mean - behind) * (mean - behind)
        });
        let joints = machine.contact.free_joints.iter().zip(distal.wrenches);
        for (k, (joint, wrench)) in joints.enumerate() {
            self.set_distal_wheels(3 + k, joint, distal);
            let motion = &distal.motions[joint.body];
            let axis = z_axis(&motion.rotation);
            self.value[3 + k] = axis.dot(&wrench.about(&motion.origin).moment);
            let mut torque = T::zero();
            for (wheel, &behind) in self.factor[2][..self.wheels].iter().enumerate() {
                if joint.supports_wheel[wheel] {
                    let contact = distal.contact(wheel) - motion.origin;
                    torque += axis.dot(&contact.cross(&distal.plane.left)) * (mean - behind);
                }
            }
            let by_spin = T::select(T::zero().lt(squares), torque / squares, T::zero());
            self.side_torque[k] = distal.spin * by_spin;
        }
    }

    /// Variance of a load by T(14a), of its `response` to the value of each row (N^2). One moment turns all joints.
    pub(crate) fn side_variance(&self, response: impl Fn(usize) -> T) -> T {
        let torques = self.side_torque.iter().enumerate();
        let load = torques.fold(T::zero(), |sum, (k, &torque)| {
            sum + response(3 + k) * torque
        });
        load * load
    }

    /// Sets the factors of a joint's row; returns the sum of the lever arms of horizontal forces at the distal
    /// wheels (m).
    pub(super) fn set_distal_wheels(
        &mut self,
        row: usize,
        joint: &TorqueJoint,
        distal: &DistalSubtrees<'_, T>,
    ) -> T {
        let motion = &distal.motions[joint.body];
        let axis = z_axis(&motion.rotation);
        let mut levers = T::zero();
        for (wheel, factor) in self.factor[row][..self.wheels].iter_mut().enumerate() {
            let contact = distal.contact(wheel) - motion.origin;
            *factor = T::zero();
            if joint.supports_wheel[wheel] {
                *factor = axis.dot(&contact.cross(&distal.force_per_load));
                levers += horizontal_lever(&axis, &contact, &distal.plane.normal);
            }
        }
        levers
    }
}

/// Inputs of the joint equations about the distal subtrees.
pub(crate) struct DistalSubtrees<'a, T: Real> {
    pub(crate) motions: &'a [BodyMotion<T>],
    /// Wrench of the distal subtree of each joint with known torque, minus the tool wrench if the tool is in it.
    pub(crate) wrenches: &'a [Wrench<T>],
    pub(crate) plane: &'a ContactPlane<T>,
    pub(crate) centres: &'a [Vector3<T>],
    /// Distance of the wheels' centres from the ground (m).
    pub(crate) radii: &'a [T],
    /// Contact force of a wheel per load: q.
    pub(crate) force_per_load: Vector3<T>,
    /// See [`spin`] (N m).
    pub(crate) spin: T,
}

impl<T: Real> DistalSubtrees<'_, T> {
    /// Where a wheel touches the ground.
    fn contact(&self, wheel: usize) -> Vector3<T> {
        self.centres[wheel] - self.plane.normal * self.radii[wheel]
    }
}

/// The wrench of each such distal subtree, minus the tool wrench where the tool is in it.
pub(crate) fn distal_wrenches<T: Real>(
    machine: &Machine,
    wrenches: &[Wrench<T>],
    tool_wrench: &Wrench<T>,
    distal: &mut [Wrench<T>],
) {
    for (joint, distal) in machine.contact.torque_joints().zip(distal) {
        let moved = newton_euler::sum(wrenches, |body| joint.supports_body[body]);
        *distal = match &machine.tool {
            Some(tool) if joint.supports_body[tool.body] => moved.minus(tool_wrench),
            _ => moved,
        };
    }
}

/// Compliance of the split rule relative to the springs in parallel with it: without measurements the rule
/// determines the split whatever this value is.
pub(super) const RULE_COMPLIANCE: f64 = 0.25;

/// s_0 of A(3), expressed by the standard deviation of a wheel's share of the warp (N).
fn prior_scale(machine: &Machine) -> f64 {
    // A warp of w at each of four wheels is a total of 2 w, and so is the residual of the rule.
    let residual = 2.0 * machine.warp_sigma();
    match machine.contact.split {
        Split::Springs => residual,
        Split::RollMomentDistribution { .. } => residual / RULE_COMPLIANCE.sqrt(),
    }
}

/// Largest torque about an axis of a unit force in the ground plane with lever arm r.
pub(super) fn horizontal_lever<T: Real>(
    axis: &Vector3<T>,
    lever: &Vector3<T>,
    normal: &Vector3<T>,
) -> T {
    let by_force = axis.cross(lever);
    let up = normal.dot(&by_force);
    let flat = by_force - normal * up;
    flat.dot(&flat).sqrt()
}
