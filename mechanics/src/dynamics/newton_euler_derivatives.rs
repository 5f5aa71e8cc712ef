//! How the wrench of the bodies changes with the motion of the joints and of the base.
//!
//! For a joint whose motion carries the bodies beyond it with the field S, its parent moving with the
//! fields v (velocity) and a (acceleration), F the wrench of the bodies beyond:
//!
//! ```text
//!     psi     = v x S                                                the rate of S
//!     dF/dq   = S x F + I (a x S - psi x v) + C(psi)
//!     dF/dq'  = 2 I psi + C(S)
//!     dF/dq'' = I S
//! ```
//! with I the moments of the bodies beyond as a map from acceleration field to wrench, and C(x) the wrench
//! of the acceleration 2 x_angular x v(r) of their particles: exact, no term left out (T(22)).

use nalgebra::Vector3;

use crate::dynamics::composite::{Composite, Field};
use crate::dynamics::kinematics::BodyMotion;
use crate::geometry::spatial::{Wrench, cross};
use crate::machine::{JointKind, Travel};
use crate::number::Real;

/// Derivatives of a wrench by position, rate and acceleration of a joint.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointWrenches<T> {
    pub(crate) position: Wrench<T>,
    pub(crate) rate: Wrench<T>,
    pub(crate) acceleration: Wrench<T>,
}

/// Fields of velocity and acceleration of a body.
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

/// A joint's field and what its parent's motion makes of it.
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
    /// The joint that carries `body` on `parent`; its axis is z of the body.
    #[inline(always)]
    pub(crate) fn new(kind: JointKind, body: &BodyMotion<T>, parent: &MotionFields<T>) -> Self {
        let z: Vector3<T> = body.rotation.column(2).into_owned();
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

    /// Derivatives of `wrench`, that of bodies beyond this joint with these moments.
    #[inline(always)]
    pub(crate) fn wrenches(&self, beyond: &Composite<T>, wrench: &Wrench<T>) -> JointWrenches<T> {
        let two = T::constant(2.0);
        let rate = beyond.accelerated(&self.rate);
        JointWrenches {
            position: self
                .field
                .carries_wrench(wrench)
                .plus(&beyond.accelerated(&self.pull))
                .plus(&beyond.coriolis(&self.rate.angular)),
            rate: Wrench {
                force: rate.force * two,
                moment: rate.moment * two,
            }
            .plus(&beyond.coriolis(&self.field.angular)),
            acceleration: beyond.accelerated(&self.field),
        }
    }
}

/// Derivatives of the wrench of bodies by the base's motion, contracted with the coefficients of one
/// number: its gradient.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BaseGradient<T> {
    /// By the specific force at the base origin.
    pub(crate) specific_force: Vector3<T>,
    /// By the base's angular velocity, the motion of the joints held.
    pub(crate) angular_velocity: Vector3<T>,
    /// By its angular acceleration.
    pub(crate) angular_acceleration: Vector3<T>,
}

/// Wrenches of a change of the base's motion, axis by axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BaseWrenches<T> {
    pub(crate) specific_force: [Wrench<T>; 3],
    pub(crate) angular_velocity: [Wrench<T>; 3],
    pub(crate) angular_acceleration: [Wrench<T>; 3],
}

impl<T: Real> BaseWrenches<T> {
    /// Of bodies with these moments on a base that turns with `w`:
    /// `dF/dw_e = C(e) + I (w x e)`.
    pub(crate) fn of(bodies: &Composite<T>, w: &Vector3<T>) -> Self {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let zero = Vector3::zeros();
        let turning = |e: &Vector3<T>| {
            bodies.accelerated(&Field {
                angular: *e,
                linear: zero,
            })
        };
        Self {
            specific_force: axes.map(|e| bodies.uniformly_accelerated(&e)),
            angular_velocity: axes.map(|e| bodies.coriolis(&e).plus(&turning(&cross(w, &e)))),
            angular_acceleration: axes.map(|e| turning(&e)),
        }
    }
}

/// Coefficients of a wrench about the base origin in its torque about a joint, times `factor`.
pub(crate) fn torque_form<T: Real>(joint: &BodyMotion<T>, factor: T) -> Wrench<T> {
    joint_form(JointKind::Revolute, joint, factor)
}

/// The same of a joint that turns, or of the force along one that slides.
pub(crate) fn joint_form<T: Real>(kind: JointKind, joint: &BodyMotion<T>, factor: T) -> Wrench<T> {
    let axis: Vector3<T> = joint.rotation.column(2).into_owned();
    let field = match kind {
        JointKind::Revolute => Field::turning(&axis, &joint.origin),
        JointKind::Prismatic => Field::sliding(&axis),
    };
    Wrench {
        force: field.linear * factor,
        moment: field.angular * factor,
    }
}

/// Derivatives of a load by travel, from those by the base's motion.
pub(crate) fn by_travel<T: Real>(
    by: &BaseGradient<T>,
    w: &Vector3<T>,
    velocity: &Vector3<T>,
) -> [T; Travel::ALL.len()] {
    let force = &by.specific_force;
    [
        force.dot(&cross(w, &Vector3::x())),
        force.dot(&cross(w, &Vector3::y())),
        force.dot(&cross(&Vector3::z(), velocity)) + by.angular_velocity.z,
        force.x,
        force.y,
        by.angular_acceleration.z,
    ]
}
