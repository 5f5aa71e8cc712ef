//! The plane that the wheels stand on, found from their centres.

use nalgebra::{Vector2, Vector3};

use crate::number::Real;

/// The tangent plane of the wheels, in base axes: x forward and y left in the plane, z its normal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactPlane<T> {
    /// Unit normal, upwards.
    pub(crate) normal: Vector3<T>,
    /// Unit vector in the plane, the base's x axis projected onto it.
    pub(crate) forward: Vector3<T>,
    /// Unit vector in the plane, to the left.
    pub(crate) left: Vector3<T>,
    /// Signed distance of the plane from the base frame's origin along the normal (m).
    pub(crate) height: T,
}

impl<T: Real> ContactPlane<T> {
    /// The second fit leaves less than a millionth of a radian for a base that leans by a tenth.
    const REFITS: usize = 2;

    /// The plane with n . c_i - R_i = height for all wheels, in the least-squares sense (exact for
    /// three wheels, and for any number on plane ground).
    ///
    /// With n = (-a, -b, 1) / s and s^2 = 1 + a^2 + b^2 it reads z_i - s R_i = a x_i + b y_i + d, linear
    /// but for s, which only matters where radii differ: [`Self::REFITS`] settle it then.
    pub(crate) fn through(centres: &[Vector3<T>], radii: &[T], radii_differ: bool) -> Self {
        let mut slope = Vector2::new(T::zero(), T::zero());
        for _ in 0..if radii_differ { Self::REFITS } else { 1 } {
            slope = fitted_slope(centres, radii, length(slope));
        }
        let s = length(slope);
        let normal = Vector3::new(-slope.x / s, -slope.y / s, T::one() / s);
        // x - (x.n) n, normalised
        let along = T::one() / (normal.y * normal.y + normal.z * normal.z).sqrt();
        let forward = Vector3::new(
            T::one() - normal.x * normal.x,
            -normal.x * normal.y,
            -normal.x * normal.z,
        ) * along;
        let left = normal.cross(&forward);
        let count = T::constant(centres.len() as f64);
        let height = centres
            .iter()
            .zip(radii)
            .fold(T::zero(), |sum, (c, &r)| sum + normal.dot(c) - r)
            / count;
        Self {
            normal,
            forward,
            left,
            height,
        }
    }

    /// Coordinates of a point in the plane's axes, origin the projection of the base frame's (m).
    pub(crate) fn coordinates(&self, point: &Vector3<T>) -> Vector2<T> {
        Vector2::new(self.forward.dot(point), self.left.dot(point))
    }
}

/// s = sqrt(1 + a^2 + b^2)
fn length<T: Real>(slope: Vector2<T>) -> T {
    (T::one() + slope.x * slope.x + slope.y * slope.y).sqrt()
}

/// Least squares for (a, b) in z_i - s R_i = a x_i + b y_i + d.
fn fitted_slope<T: Real>(centres: &[Vector3<T>], radii: &[T], s: T) -> Vector2<T> {
    let share = T::constant(1.0 / centres.len() as f64);
    let lowered = |c: &Vector3<T>, r: T| Vector3::new(c.x, c.y, c.z - s * r);
    let mean = centres
        .iter()
        .zip(radii)
        .fold(Vector3::zeros(), |sum: Vector3<T>, (c, &r)| {
            sum + lowered(c, r)
        })
        * share;
    let (mut xx, mut xy, mut yy, mut xz, mut yz) =
        (T::zero(), T::zero(), T::zero(), T::zero(), T::zero());
    for (c, &radius) in centres.iter().zip(radii) {
        let r = lowered(c, radius) - mean;
        xx += r.x * r.x;
        xy += r.x * r.y;
        yy += r.y * r.y;
        xz += r.x * r.z;
        yz += r.y * r.z;
    }
    let determinant = xx * yy - xy * xy;
    Vector2::new(
        (yy * xz - xy * yz) / determinant,
        (xx * yz - xy * xz) / determinant,
    )
}
