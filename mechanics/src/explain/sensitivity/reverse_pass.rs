//! Reverse pass from the loads' adjoints to the signals, through the bodies' wrenches, joint by joint.

use nalgebra::Vector3;

use super::carried::Carried;
use super::following::{Following, constant_followings, measured_by, solve_followed};
use super::imu_joints::ImuJoints;
use super::place_matrix::PlaceMatrix;
use super::regressor::{LinkMotion, MassiveLink, OF_LINK, PayloadMotion};
use super::sensed_motion::SensedMotion;
use super::wanted::{Forms, Wanted};
use super::writer::Writer;
use crate::dynamics::composite::Composite;
use crate::dynamics::kinematics::BodyMotion;
use crate::dynamics::newton_euler_derivatives::{
    BaseGradient, BaseWrenches, JointWrenches, MotionFields, MovingJoint, joint_form,
};
use crate::geometry::spatial::{Wrench, cross, each, rotate_each_back};
use crate::machine::{JointKind, Linkage, LinkageMotion, Machine, links_with_mass};
use crate::number::{Real, Wheels};
use crate::state::State;
use crate::wheel_loads::LoadAdjoint;

/// Quantities of one evaluation that are shared by all wheels, and scratch memory for as many wheels as are
/// processed side by side.
#[derive(Debug)]
pub(super) struct ReversePass<T: Real> {
    /// Moments of every body and its distal subtree.
    pub(super) distal: Vec<Composite<T>>,
    /// Wrench of every body and its distal subtree, minus the tool wrench.
    pub(super) distal_wrench: Vec<Wrench<T>>,
    /// All links with mass.
    links: Vec<MassiveLink>,
    /// B of every body, see [`PlaceMatrix`].
    place_matrices: Vec<PlaceMatrix<T>>,
    payloads: Vec<PayloadMotion<T>>,
    fields: Vec<MotionFields<T>>,
    wrenches: Vec<JointWrenches<T>>,
    following: Vec<Following<T>>,
    /// The measured joint that each body's joint is coupled to.
    measured: Vec<Option<usize>>,
    carried: Carried<T>,
    imu_joints: ImuJoints<T>,
    base: BaseWrenches<T>,
    /// Wrenches of the distal subtree of each joint with known torque by the motion of the base.
    distal_base: Vec<BaseWrenches<T>>,
    /// Coefficients of a wrench in the torque about (or the force along) each such joint.
    torque_forms: Vec<Wrench<T>>,
    /// Derivatives of the value of each actuated joint's equation through the changing gear ratio.
    by_gearing: Vec<T>,
    /// Derivatives with respect to position, velocity and acceleration of every measured joint.
    by_joint: Vec<[T::Wheels; 3]>,
}

impl<T: Real> ReversePass<T> {
    pub(super) fn new(machine: &Machine) -> Self {
        let n = machine.bodies.len();
        let still = BodyMotion::base(Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
        let fields = MotionFields::of(&still);
        let joint = MovingJoint::new(JointKind::Revolute, &still, &fields);
        let nothing = Composite::zero();
        let base = BaseWrenches::of(&nothing, &Vector3::zeros());
        let torque_joints = machine.contact.torque_joints().count();
        Self {
            distal: vec![nothing; n],
            distal_wrench: vec![Wrench::zero(); n],
            links: links_with_mass(machine)
                .map(|link| MassiveLink::of(machine, link))
                .collect(),
            place_matrices: vec![PlaceMatrix::of(&still); n],
            payloads: vec![PayloadMotion::still(); machine.payloads.len()],
            fields: vec![fields; n],
            wrenches: vec![joint.wrenches(&nothing, &Wrench::zero()); n],
            following: constant_followings(machine),
            measured: (0..n).map(|body| measured_by(machine, body)).collect(),
            carried: Carried::new(machine),
            imu_joints: ImuJoints::new(machine),
            base,
            distal_base: vec![base; torque_joints],
            torque_forms: vec![Wrench::zero(); torque_joints],
            by_gearing: vec![T::zero(); machine.contact.actuated_joints.len()],
            by_joint: vec![[T::Wheels::constant(0.0); 3]; machine.joints.len()],
        }
    }

    /// Computes the quantities that do not depend on the wheel. The linkages must have been solved and the moments of every
    /// body taken: see [`Self::solve`] and [`Self::take_moments`].
    pub(super) fn fill(&mut self, motion: &SensedMotion<'_, T>) {
        let machine = motion.machine;
        self.distal_wrench.copy_from_slice(motion.wrenches);
        if let Some(tool) = &machine.tool {
            let distal = &mut self.distal_wrench[tool.body];
            *distal = distal.minus(motion.tool_wrench);
        }
        for (i, body) in machine.bodies.iter().enumerate().skip(1).rev() {
            let (before, distal) = self.distal.split_at_mut(i);
            before[body.parent].add(&distal[0]);
            let (before, wrench) = self.distal_wrench.split_at_mut(i);
            before[body.parent] = before[body.parent].plus(&wrench[0]);
        }
        for (fields, body) in self.fields.iter_mut().zip(motion.motions) {
            *fields = MotionFields::of(body);
        }
        for (i, body) in machine.bodies.iter().enumerate().skip(1) {
            let parent = &self.fields[body.parent];
            let joint = MovingJoint::new(body.kind, &motion.motions[i], parent);
            self.wrenches[i] = joint.wrenches(&self.distal[i], &self.distal_wrench[i]);
            let (distal, wrenches) = (&self.distal, &self.distal_wrench);
            self.carried.fill(motion, i, &joint, distal, wrenches);
        }
        let w = &motion.motions[0].angular_velocity;
        self.base = BaseWrenches::of(&self.distal[0], w);
        for (k, joint) in machine.contact.torque_joints().enumerate() {
            self.distal_base[k] = BaseWrenches::of(&self.distal[joint.body], w);
            let kind = machine.bodies[joint.body].kind;
            self.torque_forms[k] = joint_form(kind, &motion.motions[joint.body], T::one());
        }
        for (matrix, body) in self.place_matrices.iter_mut().zip(motion.motions) {
            *matrix = PlaceMatrix::of(body);
        }
        for (place, payload) in self.payloads.iter_mut().enumerate() {
            payload.feel(motion, place, &self.place_matrices);
        }
        self.imu_joints.fill(motion, &self.following);
        self.fill_gearing(motion);
    }

    /// Motion of the joints of a linkage. Their coupling to the measured joint is kept for [`Self::fill`].
    pub(super) fn solve(&mut self, linkage: &Linkage, state: &State<T>) -> LinkageMotion<T> {
        let (solved, [pivot, cylinder, rod]) = solve_followed(linkage, state);
        self.following[linkage.bodies.pivot] = pivot;
        self.following[linkage.bodies.cylinder] = cylinder;
        self.following[linkage.bodies.rod] = rod;
        solved
    }

    /// Takes the moments of every body, to which those of its distal subtree are then added; leaves memory for the next
    /// ones.
    pub(super) fn take_moments(&mut self, bodies: &mut Vec<Composite<T>>) {
        std::mem::swap(&mut self.distal, bodies);
    }

    /// Computes the effect of the changing gear ratio between pivot, cylinder and rod on the value of an actuated
    /// joint's equation, T_p + phi' T_c + x' (T_r - f), through the derivatives of phi' and x'.
    fn fill_gearing(&mut self, motion: &SensedMotion<'_, T>) {
        let (machine, contact) = (motion.machine, &motion.machine.contact);
        for (j, joint) in contact.actuated_joints.iter().enumerate() {
            let actuation = &motion.actuations[j];
            let [_, _, by_rod] = actuation.gearing.slope;
            let mut by_position = -(by_rod * actuation.force);
            for (step, &slope) in joint.steps.iter().zip(&actuation.gearing.slope) {
                let kind = machine.bodies[step.body].kind;
                let form = joint_form(kind, &motion.motions[step.body], slope);
                by_position += self.distal_wrench[step.body].contracted(&form);
            }
            self.by_gearing[j] = by_position;
        }
    }

    /// Processes the loads of `adjoint`: fills `by_joint`, and the coefficients of every body's wrench, `by_body`; returns
    /// the derivatives with respect to the base's motion.
    pub(super) fn follow(
        &mut self,
        machine: &Machine,
        adjoint: &LoadAdjoint<T::Wheels>,
        by_body: &mut [Wrench<T::Wheels>],
    ) -> BaseGradient<T::Wheels> {
        by_body.fill(adjoint.wrench);
        self.by_joint.fill([T::Wheels::constant(0.0); 3]);
        let mut base = self.base.contracted(&adjoint.wrench);
        for (k, joint) in machine.contact.torque_joints().enumerate() {
            let torque = self.torque_form(k, adjoint);
            base.add(&self.distal_base[k].contracted(&torque));
            for (form, &carried) in by_body.iter_mut().zip(&joint.supports_body) {
                if carried {
                    *form = form.plus(&torque);
                }
            }
        }
        let forms = Forms { adjoint, by_body };
        for body in 1..machine.bodies.len() {
            let mut by = self.wrenches[body].contracted(forms.of(body));
            by[0] += self.carried.by_places(body, adjoint);
            for (k, wrenches) in self.carried.subtrees(body) {
                let more = wrenches.contracted(&self.torque_form(*k, adjoint));
                for (by, more) in by.iter_mut().zip(more) {
                    *by += more;
                }
            }
            self.by_joint_of(body, by);
        }
        for (j, joint) in machine.contact.actuated_joints.iter().enumerate() {
            let Some(linkage) = joint.linkage() else {
                continue;
            };
            let measured = machine.linkages[linkage].measured_joint;
            let by_position = T::Wheels::each(self.by_gearing[j]);
            self.by_joint[measured][0] += by_position * adjoint.gearing[j];
        }
        self.imu_joints.follow(&base, &mut self.by_joint);
        base
    }

    /// Derivative with respect to the place of a body's point, from that with respect to the specific force there.
    #[inline(always)]
    pub(super) fn by_place(
        &self,
        body: usize,
        by_force: &Vector3<T::Wheels>,
    ) -> Vector3<T::Wheels> {
        self.place_matrices[body].transposed_times(by_force)
    }

    fn torque_form(&self, k: usize, adjoint: &LoadAdjoint<T::Wheels>) -> Wrench<T::Wheels> {
        let (form, factor) = (&self.torque_forms[k], adjoint.torque[k]);
        Wrench {
            force: each(&form.force) * factor,
            moment: each(&form.moment) * factor,
        }
    }

    /// Adds derivatives with respect to a joint's coordinate to those of the measured joint it is coupled to.
    #[inline(always)]
    fn by_joint_of(&mut self, body: usize, by: [T::Wheels; 3]) {
        let Some(measured) = self.measured[body] else {
            return;
        };
        let following = &self.following[body];
        let by_coordinate = T::Wheels::each(following.coordinate);
        let by_rate = T::Wheels::each(following.rate);
        let by_acceleration = T::Wheels::each(following.acceleration);
        let [position, rate, acceleration] = by;
        let total = &mut self.by_joint[measured];
        total[0] += position * by_coordinate + rate * by_rate + acceleration * by_acceleration;
        total[1] += rate * by_coordinate + acceleration * by_rate * T::Wheels::constant(2.0);
        total[2] += acceleration * by_coordinate;
    }

    /// Writes joints, IMU, tool and actuators, in the order of the parameters; `sensed` are the derivatives with respect
    /// to the sensor's readings.
    pub(super) fn write_signals(
        &self,
        motion: &SensedMotion<'_, T>,
        forms: Forms<'_, T::Wheels>,
        sensed: &BaseGradient<T::Wheels>,
        write: &mut Writer<'_, T::Wheels>,
    ) {
        for &by in &self.by_joint {
            write.write(by);
        }
        let rotation = &motion.sensor_frame.rotation;
        for by in [
            sensed.specific_force,
            sensed.angular_velocity,
            sensed.angular_acceleration,
        ] {
            write.vector(&rotate_each_back(rotation, &by));
        }
        if let Some(tool) = &motion.machine.tool {
            let carrier = &motion.motions[tool.body];
            let rotation = carrier.rotation * tool.rotation_in_body().map(T::constant);
            let origin = each(&carrier.point(&tool.body_from_mount.translation.vector));
            let form = forms.of(tool.body);
            let by_force = -(form.force + cross(&form.moment, &origin));
            for by in [by_force, -form.moment] {
                write.vector(&rotate_each_back(&rotation, &by));
            }
        }
        for &by in &forms.adjoint.actuator {
            write.write([by]);
        }
    }

    /// Writes mass, centre of mass and inertia of every link with mass, from the derivative with the index `first` on. The
    /// motion of a link serves all wheels while it is at hand. Returns the index of the next derivative.
    pub(super) fn write_links(
        &self,
        motion: &SensedMotion<'_, T>,
        first: usize,
        wanted: &mut [Wanted<'_, T>],
    ) -> usize {
        let mut place = first;
        for massive in &self.links {
            let link = &motion.machine.links[massive.link];
            let (body, matrix) = (&motion.motions[link.body], &self.place_matrices[link.body]);
            let felt = LinkMotion::of(massive, &link.inertia, body, matrix);
            for wanted in &mut *wanted {
                for (forms, out) in wanted.groups() {
                    if let Some(out) = out[place..].first_chunk_mut() {
                        *out = felt.derivatives(link.inertia.mass, matrix, forms.of(link.body));
                    }
                }
            }
            place += OF_LINK;
        }
        place
    }

    /// Writes the mass of every payload.
    pub(super) fn write_payloads(
        &self,
        motion: &SensedMotion<'_, T>,
        forms: Forms<'_, T::Wheels>,
        write: &mut Writer<'_, T::Wheels>,
    ) {
        for (payload, felt) in motion.machine.payloads.iter().zip(&self.payloads) {
            write.write([felt.by_mass(forms.of(payload.body))]);
        }
    }
}

impl<T: Real> JointWrenches<T> {
    #[inline(always)]
    fn contracted(&self, form: &Wrench<T::Wheels>) -> [T::Wheels; 3] {
        [&self.position, &self.rate, &self.acceleration]
            .map(|wrench| wrench.contracted_side_by_side(form))
    }
}

impl<T: Real> BaseWrenches<T> {
    fn contracted(&self, form: &Wrench<T::Wheels>) -> BaseGradient<T::Wheels> {
        let by = |wrenches: &[Wrench<T>; 3]| {
            Vector3::from(
                wrenches
                    .each_ref()
                    .map(|wrench| wrench.contracted_side_by_side(form)),
            )
        };
        BaseGradient {
            specific_force: by(&self.specific_force),
            angular_velocity: by(&self.angular_velocity),
            angular_acceleration: by(&self.angular_acceleration),
        }
    }
}

impl<T: Real> BaseGradient<T> {
    pub(super) fn zero() -> Self {
        Self {
            specific_force: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
            angular_acceleration: Vector3::zeros(),
        }
    }

    fn add(&mut self, other: &Self) {
        self.specific_force += other.specific_force;
        self.angular_velocity += other.angular_velocity;
        self.angular_acceleration += other.angular_acceleration;
    }
}

impl<V: Real> BaseGradient<V> {
    /// Change of the loads with a change of the base's specific force, angular velocity and angular acceleration.
    pub(super) fn by_change<T: Real<Wheels = V>>(&self, moved: &[Vector3<T>; 3]) -> V
    where
        V: Wheels<T>,
    {
        let [force, velocity, acceleration] = moved.each_ref().map(each);
        self.specific_force.dot(&force)
            + self.angular_velocity.dot(&velocity)
            + self.angular_acceleration.dot(&acceleration)
    }

    /// Derivatives with respect to the sensor's readings, in base axes: the transpose of
    /// [`base_motion`](crate::dynamics::kinematics::base_motion).
    pub(super) fn by_sensor<T: Real<Wheels = V>>(&self, motion: &SensedMotion<'_, T>) -> Self
    where
        V: Wheels<T>,
    {
        let sensor_frame = motion.sensor_frame;
        let w = each(&motion.motions[0].angular_velocity);
        let (p, f) = (each(&sensor_frame.position), &self.specific_force);
        let angular_acceleration = self.angular_acceleration - cross(&p, f);
        let angular_velocity = self.angular_velocity
            - cross(&cross(&w, &p), f)
            - cross(&p, &cross(f, &w))
            - cross(&each(&sensor_frame.velocity), f) * V::constant(2.0)
            - cross(&each(&sensor_frame.angular_velocity), &angular_acceleration);
        Self {
            specific_force: *f,
            angular_velocity,
            angular_acceleration,
        }
    }
}
