//! Derivatives of the bodies' wrench with respect to the motion of the joints and of the base.
//!
//! For a joint whose motion moves its distal subtree with the field S, on a parent that moves with the
//! velocity field v and the acceleration field a, and with F the wrench of the distal subtree:
//!
//! ```text
//!     psi     = v x S                                                time derivative of S
//!     dF/dq   = S x F + I (a x S - psi x v) + C(psi)
//!     dF/dq'  = 2 I psi + C(S)
//!     dF/dq'' = I S
//! ```
//! where I maps an acceleration field of the distal subtree to its wrench, and C(x) is the wrench of the
//! acceleration 2 x_angular x v(r) of its particles. The derivatives are exact, no term is neglected (T(22)).

use nalgebra::Vector3;

use crate::dynamics::composite::{Composite, Field};
use crate::dynamics::kinematics::BodyMotion;
use crate::geometry::spatial::{Wrench, cross, each, z_axis, zero};
use crate::machine::{BaseMotion, JointKind};
use crate::number::Real;

/// Derivatives of a wrench with respect to position, velocity and acceleration of a joint.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointWrenches<T> {
    pub(crate) position: Wrench<T>,
    pub(crate) rate: Wrench<T>,
    pub(crate) acceleration: Wrench<T>,
}

/// Velocity and acceleration fields of a body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MotionFields<T> {
    velocity: Field<T>,
    acceleration: Field<T>,
}

impl<T: Real> MotionFields<T> {
    #[inline(always)]
    pub(crate) fn of(body: &BodyMotion<T>) -> Self {
        Self {
            velocity: body.velocity_field(),
            acceleration: body.acceleration_field(),
        }
    }
}

/// A joint's motion field and its products with the parent's motion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MovingJoint<T> {
    /// S
    pub(crate) field: Field<T>,
    /// psi
    rate: Field<T>,
    /// a x S - psi x v
    pull: Field<T>,
}

impl<T: Real> MovingJoint<T> {
    /// The joint between `parent` and `body`; its axis is the body's z axis.
    #[inline(always)]
    pub(crate) fn new(kind: JointKind, body: &BodyMotion<T>, parent: &MotionFields<T>) -> Self {
        let z = z_axis(&body.rotation);
        let field = match kind {
            JointKind::Revolute => Field::turning(&z, &body.origin),
            JointKind::Prismatic => Field::sliding(&z),
        };
        let (velocity, acceleration) = (&parent.velocity, &parent.acceleration);
        let rate = velocity.carries(&field);
        Self {
            field,
            rate,
            pull: acceleration.carries(&field).minus(&rate.carries(velocity)),
        }
    }

    /// Derivatives of `wrench`, the wrench of the distal subtree with the moments `distal`.
    #[inline(always)]
    pub(crate) fn wrenches(&self, distal: &Composite<T>, wrench: &Wrench<T>) -> JointWrenches<T> {
        let two = T::constant(2.0);
        let rate = distal.accelerated(&self.rate);
        JointWrenches {
            position: self
                .field
                .carries_wrench(wrench)
                .plus(&distal.accelerated(&self.pull))
                .plus(&distal.coriolis(&self.rate.angular)),
            rate: Wrench {
                force: rate.force * two,
                moment: rate.moment * two,
            }
            .plus(&distal.coriolis(&self.field.angular)),
            acceleration: distal.accelerated(&self.field),
        }
    }
}

/// Gradient of one scalar with respect to the motion of the base: the derivatives of the bodies' wrench,
/// contracted with the scalar's coefficients.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BaseGradient<T> {
    /// Derivative with respect to the specific force at the base origin.
    pub(crate) specific_force: Vector3<T>,
    /// Derivative with respect to the angular velocity of the base, at fixed joint motion.
    pub(crate) angular_velocity: Vector3<T>,
    /// Derivative with respect to the angular acceleration of the base.
    pub(crate) angular_acceleration: Vector3<T>,
}

/// Wrenches of a unit change of the base's motion, by axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BaseWrenches<T> {
    pub(crate) specific_force: [Wrench<T>; 3],
    pub(crate) angular_velocity: [Wrench<T>; 3],
    pub(crate) angular_acceleration: [Wrench<T>; 3],
}

impl<T: Real> BaseWrenches<T> {
    /// For bodies with these moments on a base with angular velocity `w`: `dF/dw_e = C(e) + I (w x e)`.
    pub(crate) fn of(bodies: &Composite<T>, w: &Vector3<T>) -> Self {
        let (o, l) = (T::zero(), T::one());
        let axes = [
            Vector3::new(l, o, o),
            Vector3::new(o, l, o),
            Vector3::new(o, o, l),
        ];
        let turning = |e: &Vector3<T>| {
            bodies.accelerated(&Field {
                angular: *e,
                linear: zero(),
            })
        };
        Self {
            specific_force: axes.map(|e| bodies.uniformly_accelerated(&e)),
            angular_velocity: axes.map(|e| bodies.coriolis(&e).plus(&turning(&cross(w, &e)))),
            angular_acceleration: axes.map(|e| turning(&e)),
        }
    }
}

/// Coefficients of a wrench about the base origin in its torque about a joint axis, times the factors of several
/// wheels side by side.
pub(crate) fn torque_form<T: Real>(joint: &BodyMotion<T>, factor: T::Wheels) -> Wrench<T::Wheels> {
    let form = joint_form(JointKind::Revolute, joint, T::one());
    Wrench {
        force: each(&form.force) * factor,
        moment: each(&form.moment) * factor,
    }
}

/// The same for the torque about a revolute joint, or the force along a prismatic one.
pub(crate) fn joint_form<T: Real>(kind: JointKind, joint: &BodyMotion<T>, factor: T) -> Wrench<T> {
    let axis = z_axis(&joint.rotation);
    let field = match kind {
        JointKind::Revolute => Field::turning(&axis, &joint.origin),
        JointKind::Prismatic => Field::sliding(&axis),
    };
    Wrench {
        force: field.linear * factor,
        moment: field.angular * factor,
    }
}

/// Converts derivatives of the loads of several wheels side by side with respect to the base's motion into those of
/// [`VelocityGradient`](crate::VelocityGradient).
pub(crate) fn by_base_motion<T: Real>(
    by: &BaseGradient<T::Wheels>,
    w: &Vector3<T>,
    velocity: &Vector3<T>,
) -> [T::Wheels; BaseMotion::ALL.len()] {
    let force = &by.specific_force;
    [
        force.dot(&each(&cross(w, &Vector3::x()))),
        force.dot(&each(&cross(w, &Vector3::y()))),
        force.dot(&each(&cross(&Vector3::z(), velocity))) + by.angular_velocity.z,
        force.x,
        force.y,
        by.angular_acceleration.z,
    ]
}
