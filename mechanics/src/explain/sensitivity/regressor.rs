//! Derivatives with respect to inertial parameters of links and payloads, in which the wrench is linear.
//!
//! With (u, t) the coefficients of a body's force and moment in a load, r its centre of mass, a the specific
//! force there, s = u + t x r, and B the matrix of c -> alpha x c + w x (w x c):
//! ```text
//!     dN/dm    = s.a
//!     dN/dc    = m B's + f x t                                       f = m a
//!     dN/dI_jk = t_j alpha_k + t_k alpha_j + (t x w)_j w_k + (t x w)_k w_j      half of it for j = k
//! ```

use nalgebra::{Matrix3, Vector3};

use super::place_matrix::PlaceMatrix;
use super::sensed_motion::SensedMotion;
use crate::dynamics::kinematics::BodyMotion;
use crate::geometry::spatial::{
    Wrench, compose, constant, cross, each, rotate, rotate_back, rotate_each_back,
};
use crate::machine::{Inertia, Machine};
use crate::number::{Real, Wheels};

/// Number of derivatives with respect to the parameters of a link: mass, centre of mass, inertia.
pub(super) const OF_LINK: usize = 10;

/// A link with mass.
#[derive(Debug)]
pub(super) struct MassiveLink {
    /// Index of the link.
    pub(super) link: usize,
    /// `None` where the link has the axes of its body.
    body_from_link: Option<Matrix3<f64>>,
}

impl MassiveLink {
    pub(super) fn of(machine: &Machine, link: usize) -> Self {
        let in_body = machine.links[link].body_from_link.rotation;
        let in_body = in_body.to_rotation_matrix().into_inner();
        Self {
            link,
            body_from_link: (in_body != Matrix3::identity()).then_some(in_body),
        }
    }
}

/// The motion of a link; the same for all wheels.
pub(super) struct LinkMotion<T> {
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
    #[inline(always)]
    pub(super) fn of(
        link: &MassiveLink,
        inertia: &Inertia,
        body: &BodyMotion<T>,
        place_matrix: &PlaceMatrix<T>,
    ) -> Self {
        let rotation = match &link.body_from_link {
            Some(body_from_link) => compose(&body.rotation, body_from_link),
            None => body.rotation,
        };
        let (place, measured) = at_com(inertia, body, place_matrix);
        let turning =
            [body.angular_velocity, body.angular_acceleration].map(|v| rotate_back(&rotation, &v));
        Self {
            rotation,
            place,
            measured,
            turning,
        }
    }

    /// Derivatives with respect to mass, centre of mass and inertia; `form` holds the coefficients of its body's wrench.
    #[inline(always)]
    pub(super) fn derivatives(
        &self,
        mass: f64,
        place_matrix: &PlaceMatrix<T>,
        form: &Wrench<T::Wheels>,
    ) -> [T::Wheels; OF_LINK] {
        let measured = each(&self.measured);
        let s = lever(form, &each(&self.place));
        let by_com = place_matrix.transposed_times(&s) + cross(&measured, &form.moment);
        let by_com = rotate_each_back(&self.rotation, &by_com) * T::Wheels::constant(mass);
        let t = rotate_each_back(&self.rotation, &form.moment);
        let [w, alpha] = self.turning.each_ref().map(each);
        let twisted = cross(&t, &w);
        let by = |j: usize, k: usize| t[j] * alpha[k] + twisted[j] * w[k];
        [
            s.dot(&measured),
            by_com.x,
            by_com.y,
            by_com.z,
            by(0, 0),
            by(1, 1),
            by(2, 2),
            by(0, 1) + by(1, 0),
            by(0, 2) + by(2, 0),
            by(1, 2) + by(2, 1),
        ]
    }
}

/// A payload and its motion; the same for all wheels.
#[derive(Debug, Clone)]
pub(super) struct PayloadMotion<T> {
    /// Centre of mass in base axes (m).
    place: Vector3<T>,
    /// Specific force there (m/s^2).
    measured: Vector3<T>,
    /// Share of the mass that is carried, or of the error of a mass that a signal states.
    share: T,
}

impl<T: Real> PayloadMotion<T> {
    pub(super) fn still() -> Self {
        Self {
            place: Vector3::zeros(),
            measured: Vector3::zeros(),
            share: T::zero(),
        }
    }

    pub(super) fn feel(
        &mut self,
        motion: &SensedMotion<'_, T>,
        payload: usize,
        place_matrices: &[PlaceMatrix<T>],
    ) {
        let spec = &motion.machine.payloads[payload];
        let (body, matrix) = (&motion.motions[spec.body], &place_matrices[spec.body]);
        (self.place, self.measured) = at_com(&spec.inertia, body, matrix);
        let share = motion.state.payload_share[payload];
        self.share = match spec.is_by_row {
            // the share is the mass itself, whose error is in kilograms
            true => T::select(T::zero().lt(share.abs()), T::one(), T::zero()),
            false => share,
        };
    }

    /// Derivative with respect to the mass.
    pub(super) fn by_mass(&self, form: &Wrench<T::Wheels>) -> T::Wheels {
        let s = lever(form, &each(&self.place));
        s.dot(&each(&self.measured)) * T::Wheels::each(self.share)
    }
}

/// Position of the centre of mass and the specific force there.
fn at_com<T: Real>(
    inertia: &Inertia,
    body: &BodyMotion<T>,
    place_matrix: &PlaceMatrix<T>,
) -> (Vector3<T>, Vector3<T>) {
    let com = rotate(&body.rotation, &constant(&inertia.com));
    let measured = body.specific_force + place_matrix.times(&com);
    (body.origin + com, measured)
}

/// s = u + t x r
#[inline(always)]
fn lever<T: Real>(form: &Wrench<T>, place: &Vector3<T>) -> Vector3<T> {
    form.force + cross(&form.moment, place)
}
