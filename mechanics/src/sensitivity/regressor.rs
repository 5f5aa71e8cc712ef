//! Derivatives by the inertial parameters of links and payloads, in which the wrench is linear.
//!
//! With (u, t) the coefficients of a body's force and moment in a load, r its centre of mass, a the
//! specific force there, s = u + t x r, and B' the transpose of c -> alpha x c + w x (w x c):
//! ```text
//!     dN/dm    = s.a
//!     dN/dc    = m B's + f x t                                       f = m a
//!     dN/dI_jk = t_j alpha_k + t_k alpha_j + (t x w)_j w_k + (t x w)_k w_j      half of it for j = k
//! ```

use nalgebra::{Matrix3, Vector3};

use super::chain::{Chain, SensedMotion};
use super::geometry::pulled;
use super::parameter::{InertiaElement, massive_links};
use crate::kinematics::BodyMotion;
use crate::machine::Inertia;
use crate::number::Real;
use crate::spatial::{Wrench, compose, constant, cross, rotate, rotate_back};

impl<T: Real> Chain<T> {
    /// Mass, centre of mass and inertia of every link with mass.
    pub(super) fn write_links(&self, motion: &SensedMotion<'_, T>, write: &mut impl FnMut(T)) {
        for link in massive_links(motion.machine) {
            let link = &motion.machine.links[link];
            let body = &motion.motions[link.body];
            let rotation = compose(
                &body.rotation,
                link.body_from_link.rotation.to_rotation_matrix().matrix(),
            );
            write_link(&link.inertia, body, &rotation, &self.form[link.body], write);
        }
    }

    /// Mass of every payload.
    pub(super) fn write_payloads(&self, motion: &SensedMotion<'_, T>, write: &mut impl FnMut(T)) {
        let payloads = motion.machine.payloads.iter();
        for (payload, &share) in payloads.zip(&motion.state.payload_share) {
            let body = &motion.motions[payload.body];
            let (place, felt) = at_com(&payload.inertia, body);
            write(lever(&self.form[payload.body], &place).dot(&felt) * share);
        }
    }
}

fn write_link<T: Real>(
    inertia: &Inertia,
    body: &BodyMotion<T>,
    rotation: &Matrix3<T>,
    form: &Wrench<T>,
    write: &mut impl FnMut(T),
) {
    let (place, felt) = at_com(inertia, body);
    let s = lever(form, &place);
    write(s.dot(&felt));
    let by_com = (pulled(body, &s) + cross(&felt, &form.moment)) * T::constant(inertia.mass);
    rotate_back(rotation, &by_com)
        .iter()
        .for_each(|&value| write(value));
    let in_link = |v: &Vector3<T>| rotate_back(rotation, v);
    let (t, w, alpha) = (
        in_link(&form.moment),
        in_link(&body.angular_velocity),
        in_link(&body.angular_acceleration),
    );
    let twisted = cross(&t, &w);
    for element in InertiaElement::ALL {
        let (j, k) = element.place();
        let mut by = t[j] * alpha[k] + twisted[j] * w[k];
        if j != k {
            by += t[k] * alpha[j] + twisted[k] * w[j];
        }
        write(by);
    }
}

/// Place of the centre of mass and the specific force there.
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
