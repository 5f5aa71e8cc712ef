//! Reverse pass from a load's adjoint to the signals, through the bodies' wrenches, joint by joint.

use nalgebra::Vector3;

use super::regressor::{LinkMotion, at_com, lever};
use super::sensed_motion::SensedMotion;
use super::writer::Writer;
use crate::dynamics::composite::{Composite, Field};
use crate::dynamics::kinematics::{BodyMotion, SensorFrame, base_motion};
use crate::dynamics::newton_euler_derivatives::{
    BaseGradient, BaseWrenches, JointWrenches, MotionFields, MovingJoint, joint_form,
};
use crate::geometry::coordinate::Coordinate;
use crate::geometry::spatial::{Wrench, cross, rotate_back};
use crate::machine::{
    JointCoupling, JointKind, Linkage, Machine, TorqueJoint, links_with_mass, rotation_in_body,
};
use crate::number::{Dual, Real};
use crate::state::{ImuState, State};
use crate::wheel_loads::LoadAdjoint;

/// Derivatives of a joint's coordinate with respect to the measured joint that it is coupled to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Following<T> {
    /// Of the coordinate with respect to position; equal to velocity by velocity and acceleration by
    /// acceleration.
    pub(crate) coordinate: T,
    /// Of the velocity with respect to position; half of acceleration by velocity.
    rate: T,
    /// Of the acceleration with respect to position.
    acceleration: T,
}

/// Quantities of one evaluation that are shared by all wheels, and scratch memory for one wheel.
#[derive(Debug)]
pub(super) struct ReversePass<T: Real> {
    /// Moments of every body and its distal subtree.
    pub(super) distal: Vec<Composite<T>>,
    /// Wrench of every body and its distal subtree, minus the tool wrench.
    pub(super) distal_wrench: Vec<Wrench<T>>,
    /// All links with mass.
    pub(super) links: Vec<LinkMotion<T>>,
    fields: Vec<MotionFields<T>>,
    joints: Vec<MovingJoint<T>>,
    wrenches: Vec<JointWrenches<T>>,
    following: Vec<Following<T>>,
    base: BaseWrenches<T>,
    /// Of the distal subtree of each joint with known torque.
    distal_base: Vec<BaseWrenches<T>>,
    /// Coefficients of every body's wrench in the current load.
    pub(super) form: Vec<Wrench<T>>,
    /// Derivatives with respect to position, velocity and acceleration of every measured joint.
    by_joint: Vec<[T; 3]>,
    dual_coordinates: Vec<Coordinate<Dual<T>>>,
}

impl<T: Real> ReversePass<T> {
    pub(super) fn new(machine: &Machine) -> Self {
        let (n, zero) = (machine.bodies.len(), T::zero());
        let still = BodyMotion::base(Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
        let fields = MotionFields::of(&still);
        let joint = MovingJoint::new(JointKind::Revolute, &still, &fields);
        let nothing = Composite::zero();
        let base = BaseWrenches::of(&nothing, &Vector3::zeros());
        let dual = Dual::constant(0.0);
        Self {
            distal: vec![nothing; n],
            distal_wrench: vec![Wrench::zero(); n],
            links: links_with_mass(machine).map(LinkMotion::still).collect(),
            fields: vec![fields; n],
            joints: vec![joint; n],
            wrenches: vec![joint.wrenches(&nothing, &Wrench::zero()); n],
            following: vec![
                Following {
                    coordinate: zero,
                    rate: zero,
                    acceleration: zero
                };
                n
            ],
            base,
            distal_base: vec![base; machine.contact.torque_joints().count()],
            form: vec![Wrench::zero(); n],
            by_joint: vec![[zero; 3]; machine.joints.len()],
            dual_coordinates: vec![Coordinate::slid(dual, dual, dual); n],
        }
    }

    /// Computes the quantities that do not depend on the wheel.
    pub(super) fn fill(&mut self, motion: &SensedMotion<'_, T>) {
        let machine = motion.machine;
        self.distal.copy_from_slice(&motion.groups.bodies);
        self.distal_wrench.copy_from_slice(motion.wrenches);
        if let Some(tool) = &machine.tool {
            let distal = &mut self.distal_wrench[tool.body];
            *distal = distal.minus(motion.tool_wrench);
        }
        for (i, body) in machine.bodies.iter().enumerate().skip(1).rev() {
            let (distal, wrench) = (self.distal[i], self.distal_wrench[i]);
            self.distal[body.parent].add(&distal);
            self.distal_wrench[body.parent] = self.distal_wrench[body.parent].plus(&wrench);
        }
        for (fields, body) in self.fields.iter_mut().zip(motion.motions) {
            *fields = MotionFields::of(body);
        }
        for (i, body) in machine.bodies.iter().enumerate().skip(1) {
            let parent = &self.fields[body.parent];
            self.joints[i] = MovingJoint::new(body.kind, &motion.motions[i], parent);
            self.wrenches[i] = self.joints[i].wrenches(&self.distal[i], &self.distal_wrench[i]);
        }
        let w = &motion.motions[0].angular_velocity;
        self.base = BaseWrenches::of(&self.distal[0], w);
        for (k, joint) in machine.contact.torque_joints().enumerate() {
            self.distal_base[k] = BaseWrenches::of(&self.distal[joint.body], w);
        }
        for link in &mut self.links {
            link.feel(motion);
        }
        self.follow_measured(motion);
    }

    /// Computes the coupling of every joint to the measured ones; for a closed triangle from its own equations in
    /// dual numbers.
    fn follow_measured(&mut self, motion: &SensedMotion<'_, T>) {
        let machine = motion.machine;
        let directly = |factor: T| Following {
            coordinate: factor,
            rate: T::zero(),
            acceleration: T::zero(),
        };
        for (following, body) in self.following.iter_mut().zip(&machine.bodies) {
            match body.coupling {
                JointCoupling::Measured(_) => *following = directly(T::one()),
                JointCoupling::Mimic { multiplier, .. } => {
                    *following = directly(T::constant(multiplier));
                }
                _ => {}
            }
        }
        for linkage in &machine.linkages {
            let [pivot, cylinder, rod] = followed_by(linkage, motion.state);
            self.following[linkage.bodies.pivot] = pivot;
            self.following[linkage.bodies.cylinder] = cylinder;
            self.following[linkage.bodies.rod] = rod;
        }
    }

    /// Processes the load of `adjoint`: fills `form` and `by_joint`, and returns the derivatives with respect to
    /// the base's motion.
    pub(super) fn follow(
        &mut self,
        motion: &SensedMotion<'_, T>,
        adjoint: &LoadAdjoint<T>,
    ) -> BaseGradient<T> {
        let machine = motion.machine;
        let form_of = |joint: &TorqueJoint, factor: T| {
            let kind = machine.bodies[joint.body].kind;
            joint_form(kind, &motion.motions[joint.body], factor)
        };
        self.form.fill(adjoint.wrench);
        self.by_joint.fill([T::zero(); 3]);
        let mut base = self.base.contracted(&adjoint.wrench);
        for (k, joint) in machine.contact.torque_joints().enumerate() {
            let torque = form_of(joint, adjoint.torque[k]);
            base.add(&self.distal_base[k].contracted(&torque));
            for (form, &carried) in self.form.iter_mut().zip(&joint.supports_body) {
                if carried {
                    *form = form.plus(&torque);
                }
            }
        }
        for body in 1..machine.bodies.len() {
            let mut by = self.wrenches[body].contracted(&self.form[body]);
            let field = &self.joints[body].field;
            by[0] += by_places(machine, motion, adjoint, body, field);
            for (k, joint) in machine.contact.torque_joints().enumerate() {
                // A joint closer to the base moves the free joint's distal subtree as a whole.
                if joint.body != body && machine.is_carried_by(joint.body, body) {
                    let torque = form_of(joint, adjoint.torque[k]);
                    let (moments, wrench) =
                        (&self.distal[joint.body], &self.distal_wrench[joint.body]);
                    let more = self.joints[body]
                        .wrenches(moments, wrench)
                        .contracted(&torque);
                    for (by, more) in by.iter_mut().zip(more) {
                        *by += more;
                    }
                }
            }
            self.by_joint_of(machine, body, by);
        }
        self.follow_gearing(motion, adjoint);
        self.follow_imu(motion, &base);
        base
    }

    /// Adds the effect of the changing gear ratio between pivot, cylinder and rod on the value of an actuated
    /// joint's equation, T_p + phi' T_c + x' (T_r - f), through the derivatives of phi' and x'.
    fn follow_gearing(&mut self, motion: &SensedMotion<'_, T>, adjoint: &LoadAdjoint<T>) {
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
            let measured = machine.linkages[joint.linkage].measured_joint;
            self.by_joint[measured][0] += by_position * adjoint.gearing[j];
        }
    }

    /// Adds derivatives with respect to a joint's coordinate to those of the measured joint it is coupled to.
    fn by_joint_of(&mut self, machine: &Machine, body: usize, by: [T; 3]) {
        let Some(measured) = measured_by(machine, body) else {
            return;
        };
        let following = &self.following[body];
        let [position, rate, acceleration] = by;
        let total = &mut self.by_joint[measured];
        total[0] += position * following.coordinate
            + rate * following.rate
            + acceleration * following.acceleration;
        total[1] += rate * following.coordinate + acceleration * following.rate * T::constant(2.0);
        total[2] += acceleration * following.coordinate;
    }

    /// On a moving body, the joints between base and IMU affect the estimated base motion: differentiates it in
    /// dual numbers, joint by joint.
    fn follow_imu(&mut self, motion: &SensedMotion<'_, T>, base: &BaseGradient<T>) {
        let machine = motion.machine;
        let imu = ImuState {
            specific_force: motion.state.imu.specific_force.map(Dual::fixed),
            angular_velocity: motion.state.imu.angular_velocity.map(Dual::fixed),
            angular_acceleration: motion.state.imu.angular_acceleration.map(Dual::fixed),
        };
        let mut carrier = machine.imu.body;
        while carrier != 0 {
            if let Some(measured) = measured_by(machine, carrier) {
                for jet in 0..3 {
                    self.vary(motion, carrier, jet);
                    let sensor_frame = SensorFrame::of(machine, &self.dual_coordinates);
                    let moved = base_motion(machine, &sensor_frame, &imu);
                    self.by_joint[measured][jet] += base.by_change(&moved);
                }
            }
            carrier = machine.bodies[carrier].parent;
        }
    }

    /// Sets the coordinates of all joints, with that of `body` a function of its measured joint's position (0),
    /// velocity (1) or acceleration (2).
    fn vary(&mut self, motion: &SensedMotion<'_, T>, body: usize, jet: usize) {
        for (dual, coordinate) in self.dual_coordinates.iter_mut().zip(motion.coordinates) {
            *dual = coordinate.map(Dual::fixed);
        }
        let (following, zero) = (&self.following[body], T::zero());
        let two = T::constant(2.0);
        let [moved, rate, acceleration] = match jet {
            0 => [following.coordinate, following.rate, following.acceleration],
            1 => [zero, following.coordinate, following.rate * two],
            _ => [zero, zero, following.coordinate],
        };
        let dual = &mut self.dual_coordinates[body];
        match motion.machine.bodies[body].kind {
            JointKind::Revolute => {
                (dual.sin.slope, dual.cos.slope) =
                    (dual.cos.value * moved, -dual.sin.value * moved);
            }
            JointKind::Prismatic => dual.displacement.slope = moved,
        }
        dual.rate.slope = rate;
        dual.acceleration.slope = acceleration;
    }

    /// Writes joints, IMU, tool and actuators, in the order of the parameters.
    pub(super) fn write_signals(
        &self,
        motion: &SensedMotion<'_, T>,
        adjoint: &LoadAdjoint<T>,
        base: &BaseGradient<T>,
        write: &mut Writer<'_, T>,
    ) {
        for &by in &self.by_joint {
            write.write(by);
        }
        let sensed = base.by_sensor(motion);
        for by in [
            sensed.specific_force,
            sensed.angular_velocity,
            sensed.angular_acceleration,
        ] {
            write.vector(&rotate_back(&motion.sensor_frame.rotation, &by));
        }
        if let Some(tool) = &motion.machine.tool {
            let carrier = &motion.motions[tool.body];
            let rotation = carrier.rotation * rotation_in_body(tool).map(T::constant);
            let origin = carrier.point(&tool.body_from_mount.translation.vector);
            let form = &self.form[tool.body];
            let by_force = -(form.force + cross(&form.moment, &origin));
            for by in [by_force, -form.moment] {
                write.vector(&rotate_back(&rotation, &by));
            }
        }
        for &by in &adjoint.actuator {
            write.write([by]);
        }
    }
}

impl<T: Real> ReversePass<T> {
    /// Writes mass, centre of mass and inertia of every link with mass.
    pub(super) fn write_links(&self, motion: &SensedMotion<'_, T>, write: &mut Writer<'_, T>) {
        for measured in &self.links {
            let link = &motion.machine.links[measured.link];
            let body = &motion.motions[link.body];
            measured.write(link.inertia.mass, body, &self.form[link.body], write);
        }
    }

    /// Writes the mass of every payload.
    pub(super) fn write_payloads(&self, motion: &SensedMotion<'_, T>, write: &mut Writer<'_, T>) {
        let payloads = motion.machine.payloads.iter();
        for (payload, &share) in payloads.zip(&motion.state.payload_share) {
            let body = &motion.motions[payload.body];
            let (place, measured) = at_com(&payload.inertia, body);
            write.write([lever(&self.form[payload.body], &place).dot(&measured) * share]);
        }
    }
}

/// Derivative with respect to a joint's position through the wheels and joints in its distal subtree.
fn by_places<T: Real>(
    machine: &Machine,
    motion: &SensedMotion<'_, T>,
    adjoint: &LoadAdjoint<T>,
    body: usize,
    field: &Field<T>,
) -> T {
    let mut by = T::zero();
    for (wheel, spec) in machine.wheels.iter().enumerate() {
        if machine.is_carried_by(spec.body, body) {
            by += adjoint.centre[wheel].dot(&field.at(&motion.centres[wheel]));
        }
    }
    for (k, joint) in machine.contact.torque_joints().enumerate() {
        if machine.is_carried_by(joint.body, body) {
            let free = &motion.motions[joint.body];
            let axis: Vector3<T> = free.rotation.column(2).into_owned();
            let [by_origin, by_axis] = &adjoint.axis[k];
            by +=
                by_origin.dot(&field.at(&free.origin)) + by_axis.dot(&cross(&field.angular, &axis));
        }
    }
    by
}

/// The measured joint that a body's joint is coupled to.
fn measured_by(machine: &Machine, body: usize) -> Option<usize> {
    match machine.bodies[body].coupling {
        JointCoupling::Root => None,
        JointCoupling::Measured(joint) | JointCoupling::Mimic { joint, .. } => Some(joint),
        JointCoupling::Pivot(linkage)
        | JointCoupling::Cylinder(linkage)
        | JointCoupling::Rod(linkage) => Some(machine.linkages[linkage].measured_joint),
    }
}

/// Coupling of pivot, cylinder and rod to the measured joint of the linkage.
pub(crate) fn followed_by<T: Real>(linkage: &Linkage, state: &State<T>) -> [Following<T>; 3] {
    let mut measured = state.joints[linkage.measured_joint].map(Dual::fixed);
    measured.position.slope = T::one();
    let solved = linkage.solve(&measured);
    let turned = |c: &Coordinate<Dual<T>>| c.cos.value * c.sin.slope - c.sin.value * c.cos.slope;
    let following = |c: &Coordinate<Dual<T>>, coordinate: T| Following {
        coordinate,
        rate: c.rate.slope,
        acceleration: c.acceleration.slope,
    };
    [
        following(&solved.pivot, turned(&solved.pivot)),
        following(&solved.cylinder, turned(&solved.cylinder)),
        following(&solved.rod, solved.rod.displacement.slope),
    ]
}

impl<T: Real> JointWrenches<T> {
    fn contracted(&self, form: &Wrench<T>) -> [T; 3] {
        [
            self.position.contracted(form),
            self.rate.contracted(form),
            self.acceleration.contracted(form),
        ]
    }
}

impl<T: Real> BaseWrenches<T> {
    fn contracted(&self, form: &Wrench<T>) -> BaseGradient<T> {
        let by = |wrenches: &[Wrench<T>; 3]| {
            Vector3::from(wrenches.each_ref().map(|wrench| wrench.contracted(form)))
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

    /// Change of the load with a change of the base's motion.
    fn by_change(&self, moved: &BodyMotion<Dual<T>>) -> T {
        let slopes = |v: &Vector3<Dual<T>>| v.map(|component| component.slope);
        self.specific_force.dot(&slopes(&moved.specific_force))
            + self.angular_velocity.dot(&slopes(&moved.angular_velocity))
            + self
                .angular_acceleration
                .dot(&slopes(&moved.angular_acceleration))
    }

    /// Derivatives with respect to the sensor's readings, in base axes: the transpose of [`base_motion`].
    pub(super) fn by_sensor(&self, motion: &SensedMotion<'_, T>) -> Self {
        let (sensor_frame, w) = (motion.sensor_frame, &motion.motions[0].angular_velocity);
        let (p, f) = (&sensor_frame.position, &self.specific_force);
        let angular_acceleration = self.angular_acceleration - cross(p, f);
        let angular_velocity = self.angular_velocity
            - cross(&cross(w, p), f)
            - cross(p, &cross(f, w))
            - cross(&sensor_frame.velocity, f) * T::constant(2.0)
            - cross(&sensor_frame.angular_velocity, &angular_acceleration);
        Self {
            specific_force: *f,
            angular_velocity,
            angular_acceleration,
        }
    }
}
