//! Derivative of the specific force with respect to the place of a point of a body:
//! ```text
//!     B d = alpha x d + w x (w x d)
//! ```

use nalgebra::{Matrix3, Vector3};

use crate::dynamics::kinematics::BodyMotion;
use crate::geometry::spatial::{rotate, rotate_each_back};
use crate::number::Real;

/// B of a body, the same for all wheels.
#[derive(Debug, Clone)]
pub(super) struct PlaceMatrix<T>(Matrix3<T>);

impl<T: Real> PlaceMatrix<T> {
    #[inline(always)]
    pub(super) fn of(body: &BodyMotion<T>) -> Self {
        let (w, alpha) = (&body.angular_velocity, &body.angular_acceleration);
        let (xx, yy, zz) = (w.x * w.x, w.y * w.y, w.z * w.z);
        let (xy, xz, yz) = (w.x * w.y, w.x * w.z, w.y * w.z);
        Self(Matrix3::new(
            -(yy + zz),
            xy - alpha.z,
            xz + alpha.y,
            xy + alpha.z,
            -(xx + zz),
            yz - alpha.x,
            xz - alpha.y,
            yz + alpha.x,
            -(xx + yy),
        ))
    }

    /// B v.
    #[inline(always)]
    pub(super) fn times(&self, v: &Vector3<T>) -> Vector3<T> {
        rotate(&self.0, v)
    }

    /// B' v, for several wheels side by side.
    #[inline(always)]
    pub(super) fn transposed_times(&self, v: &Vector3<T::Wheels>) -> Vector3<T::Wheels> {
        rotate_each_back(&self.0, v)
    }
}
