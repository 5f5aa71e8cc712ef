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

use super::Writer;
use super::chain::{Chain, SensedMotion};
use super::geometry::pulled;
use crate::kinematics::BodyMotion;
use crate::machine::Inertia;
use crate::number::Real;
use crate::spatial::{Wrench, compose, constant, cross, rotate, rotate_back};

/// A link with mass and its motion; the same for all wheels.
#[derive(Debug, Clone)]
pub(super) struct FeltLink<T: Real> {
    /// Index of the link.
    link: usize,
    /// Orientation: base from link.
    rotation: Matrix3<T>,
    /// Centre of mass in base axes (m).
    place: Vector3<T>,
    /// Specific force there (m/s^2).
    felt: Vector3<T>,
    /// Angular velocity and acceleration in the link's axes.
    turning: [Vector3<T>; 2],
}

impl<T: Real> FeltLink<T> {
    pub(super) fn still(link: usize) -> Self {
        let zero = Vector3::zeros();
        Self {
            link,
            rotation: Matrix3::identity(),
            place: zero,
            felt: zero,
            turning: [zero; 2],
        }
    }

    #[inline(always)]
    pub(super) fn feel(&mut self, motion: &SensedMotion<'_, T>) {
        let link = &motion.machine.links[self.link];
        let body = &motion.motions[link.body];
        let in_body = link.body_from_link.rotation.to_rotation_matrix();
        self.rotation = compose(&body.rotation, in_body.matrix());
        (self.place, self.felt) = at_com(&link.inertia, body);
        self.turning = [body.angular_velocity, body.angular_acceleration]
            .map(|v| rotate_back(&self.rotation, &v));
    }

    /// Writes mass, centre of mass and inertia; `form` holds the coefficients of its body's wrench.
    #[inline(always)]
    fn write(&self, mass: f64, body: &BodyMotion<T>, form: &Wrench<T>, write: &mut Writer<'_, T>) {
        let s = lever(form, &self.place);
        let by_com = pulled(body, &s) + cross(&self.felt, &form.moment);
        let by_com = rotate_back(&self.rotation, &by_com) * T::constant(mass);
        let t = rotate_back(&self.rotation, &form.moment);
        let [w, alpha] = &self.turning;
        let twisted = cross(&t, w);
        let by = |j: usize, k: usize| t[j] * alpha[k] + twisted[j] * w[k];
        write.write([
            s.dot(&self.felt),
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

impl<T: Real> Chain<T> {
    /// Writes mass, centre of mass and inertia of every link with mass.
    pub(super) fn write_links(&self, motion: &SensedMotion<'_, T>, write: &mut Writer<'_, T>) {
        for felt in &self.links {
            let link = &motion.machine.links[felt.link];
            let body = &motion.motions[link.body];
            felt.write(link.inertia.mass, body, &self.form[link.body], write);
        }
    }

    /// Writes the mass of every payload.
    pub(super) fn write_payloads(&self, motion: &SensedMotion<'_, T>, write: &mut Writer<'_, T>) {
        let payloads = motion.machine.payloads.iter();
        for (payload, &share) in payloads.zip(&motion.state.payload_share) {
            let body = &motion.motions[payload.body];
            let (place, felt) = at_com(&payload.inertia, body);
            write.write([lever(&self.form[payload.body], &place).dot(&felt) * share]);
        }
    }
}

/// Position of the centre of mass and the specific force there.
fn at_com<T: Real>(inertia: &Inertia, body: &BodyMotion<T>) -> (Vector3<T>, Vector3<T>) {
    let com = rotate(&body.rotation, &constant(&inertia.com));
    let (w, alpha) = (&body.angular_velocity, &body.angular_acceleration);
    let felt = body.specific_force + cross(alpha, &com) + cross(w, &cross(w, &com));
    (body.origin + com, felt)
}

/// s = u + t x r
fn lever<T: Real>(form: &Wrench<T>, place: &Vector3<T>) -> Vector3<T> {
    form.force + cross(&form.moment, place)
}
