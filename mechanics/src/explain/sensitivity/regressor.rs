//! Derivatives with respect to inertial parameters of links and payloads, in which the wrench is linear.
//!
//! With (u, t) the coefficients of a body's force and moment in a load, r its centre of mass, a the specific
//! force there, s = u + t x r, and B' the transpose of c -> alpha x c + w x (w x c):
//! ```text
//!     dN/dm    = s.a
//!     dN/dc    = m B's + f x t                                       f = m a
//!     dN/dI_jk = t_j alpha_k + t_k alpha_j + (t x w)_j w_k + (t x w)_k w_j      half of it for j = k
//! ```

use nalgebra::{Matrix3, Vector3};

use super::sensed_motion::SensedMotion;
use super::writer::Writer;
use crate::dynamics::kinematics::BodyMotion;
use crate::geometry::spatial::{Wrench, compose, constant, cross, rotate, rotate_back};
use crate::machine::Inertia;
use crate::number::Real;

/// A link with mass and its motion; the same for all wheels.
#[derive(Debug, Clone)]
pub(super) struct LinkMotion<T: Real> {
    /// Index of the link.
    pub(super) link: usize,
    /// Orientation: base from link.
    rotation: Matrix3<T>,
    /// Centre of mass in base axes (m).
    place: Vector3<T>,
    /// Specific force there (m/s^2).
    measured: Vector3<T>,
    /// Angular velocity and acceleration in the link's axes.
    turning: [Vector3<T>; 2],
}

impl<T: Real> LinkMotion<T> {
    pub(super) fn still(link: usize) -> Self {
        let zero = Vector3::zeros();
        Self {
            link,
            rotation: Matrix3::identity(),
            place: zero,
            measured: zero,
            turning: [zero; 2],
        }
    }

    #[inline(always)]
    pub(super) fn feel(&mut self, motion: &SensedMotion<'_, T>) {
        let link = &motion.machine.links[self.link];
        let body = &motion.motions[link.body];
        let in_body = link.body_from_link.rotation.to_rotation_matrix();
        self.rotation = compose(&body.rotation, in_body.matrix());
        (self.place, self.measured) = at_com(&link.inertia, body);
        self.turning = [body.angular_velocity, body.angular_acceleration]
            .map(|v| rotate_back(&self.rotation, &v));
    }

    /// Writes mass, centre of mass and inertia; `form` holds the coefficients of its body's wrench.
    #[inline(always)]
    pub(super) fn write(
        &self,
        mass: f64,
        body: &BodyMotion<T>,
        form: &Wrench<T>,
        write: &mut Writer<'_, T>,
    ) {
        let s = lever(form, &self.place);
        let by_com = pulled(body, &s) + cross(&self.measured, &form.moment);
        let by_com = rotate_back(&self.rotation, &by_com) * T::constant(mass);
        let t = rotate_back(&self.rotation, &form.moment);
        let [w, alpha] = &self.turning;
        let twisted = cross(&t, w);
        let by = |j: usize, k: usize| t[j] * alpha[k] + twisted[j] * w[k];
        write.write([
            s.dot(&self.measured),
            by_com.x,
            by_com.y,
            by_com.z,
            by(0, 0),
            by(1, 1),
            by(2, 2),
            by(0, 1) + by(1, 0),
            by(0, 2) + by(2, 0),
            by(1, 2) + by(2, 1),
        ]);
    }
}

/// Position of the centre of mass and the specific force there.
pub(super) fn at_com<T: Real>(inertia: &Inertia, body: &BodyMotion<T>) -> (Vector3<T>, Vector3<T>) {
    let com = rotate(&body.rotation, &constant(&inertia.com));
    let (w, alpha) = (&body.angular_velocity, &body.angular_acceleration);
    let measured = body.specific_force + cross(alpha, &com) + cross(w, &cross(w, &com));
    (body.origin + com, measured)
}

/// s = u + t x r
pub(super) fn lever<T: Real>(form: &Wrench<T>, place: &Vector3<T>) -> Vector3<T> {
    form.force + cross(&form.moment, place)
}

/// The transpose of d -> alpha x d + w x (w x d).
pub(super) fn pulled<T: Real>(carrier: &BodyMotion<T>, by: &Vector3<T>) -> Vector3<T> {
    let (w, alpha) = (&carrier.angular_velocity, &carrier.angular_acceleration);
    cross(by, alpha) + cross(w, &cross(w, by))
}
