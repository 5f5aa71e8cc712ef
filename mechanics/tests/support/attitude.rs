//! Slope angles of the platform and the up direction in its axes.

use nalgebra::{Matrix3, Vector3};
use tipwatch_mechanics::Real;

/// Theta, Phi and Psi of (8): rotations about y, then x, then z, from Earth axes to platform axes.
///
/// Theta and Phi are the slope of the ground plane relative to the direction from which Psi is measured. With
/// Psi = 0 they are the platform's own: Theta > 0 is nose down; Phi > 0 is left side up, which loads the
/// right wheels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Attitude<T> {
    /// Theta, about y (rad).
    pub(crate) theta: T,
    /// Phi, about x (rad).
    pub(crate) phi: T,
    /// Psi, about the plane's normal (rad).
    pub(crate) psi: T,
}

impl<T: Real> Attitude<T> {
    /// Third row of (8): the unit vector pointing up, in platform axes (r31, r32, r33).
    ///
    /// ```text
    ///     r31 = -cosPsi sinTheta + cosTheta sinPhi sinPsi
    ///     r32 =  cosTheta cosPsi sinPhi + sinTheta sinPsi
    ///     r33 =  cosTheta cosPhi
    /// ```
    pub(crate) fn up(&self) -> Vector3<T> {
        let ((st, ct), (sf, cf), (sp, cp)) = self.sines_and_cosines();
        Vector3::new(ct * sf * sp - cp * st, ct * cp * sf + st * sp, ct * cf)
    }

    /// (8): maps platform axes to Earth axes.
    pub(crate) fn rotation(&self) -> Matrix3<T> {
        let ((st, ct), (sf, cf), (sp, cp)) = self.sines_and_cosines();
        let up = self.up();
        Matrix3::new(
            ct * cp + st * sf * sp,
            cp * st * sf - ct * sp,
            cf * st,
            cf * sp,
            cf * cp,
            -sf,
            up.x,
            up.y,
            up.z,
        )
    }

    /// The angles for an up direction in platform axes (any length) and a given Psi (rad), since up determines
    /// only two of the three. Psi = 0 is the convention with an IMU alone.
    ///
    /// ```text
    ///     q = Rz(Psi) up    Theta = atan2(-q_x, |(q_y, q_z)|)    Phi = atan2(q_y, q_z)
    /// ```
    /// Theta is within a quarter turn; Phi is 0 where the platform stands on its nose or tail.
    pub(crate) fn of_up(up: &Vector3<T>, psi: T) -> Self {
        let (sin, cos) = psi.sin_cos();
        let x = cos * up.x - sin * up.y;
        let y = sin * up.x + cos * up.y;
        Self {
            theta: (-x).atan2((y * y + up.z * up.z).sqrt()),
            phi: y.atan2(up.z),
            psi,
        }
    }

    /// The angles of a rotation from platform axes to Earth axes.
    ///
    /// Theta = atan2(R13, R33), Phi = atan2(-R23, |(R21, R22)|), Psi = atan2(R21, R22)
    pub(crate) fn of_rotation(r: &Matrix3<T>) -> Self {
        Self {
            theta: r.m13.atan2(r.m33),
            phi: (-r.m23).atan2((r.m21 * r.m21 + r.m22 * r.m22).sqrt()),
            psi: r.m21.atan2(r.m22),
        }
    }

    /// (10): angular velocity in platform axes (rad/s) from the rates of the angles (rad/s). The model uses only
    /// its third component, as Psidot (11).
    pub(crate) fn angular_velocity(&self, rates: &Self) -> Vector3<T> {
        let (_, (sf, cf), (sp, cp)) = self.sines_and_cosines();
        Vector3::new(
            rates.phi * cp + rates.theta * cf * sp,
            rates.theta * cf * cp - rates.phi * sp,
            rates.psi - rates.theta * sf,
        )
    }

    fn sines_and_cosines(&self) -> ((T, T), (T, T), (T, T)) {
        (self.theta.sin_cos(), self.phi.sin_cos(), self.psi.sin_cos())
    }
}
