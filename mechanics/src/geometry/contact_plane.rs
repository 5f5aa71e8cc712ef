//! The contact plane, fitted to the wheels' centres and radii.

use nalgebra::{Vector2, Vector3};

use crate::geometry::spatial::zero;
use crate::number::Real;

/// The tangent plane of the wheels, in base axes: x forward and y left in the plane, z its normal.
#[derive(Debug, Clone, Copy)]
pub struct ContactPlane<T> {
    /// Unit normal, pointing up.
    pub normal: Vector3<T>,
    /// Unit vector in the plane, the base's x axis projected onto it.
    pub forward: Vector3<T>,
    /// Unit vector in the plane, to the left.
    pub left: Vector3<T>,
    /// Signed distance of the plane from the base frame's origin along the normal (m).
    pub height: T,
    /// a and b of the plane z = a x + b y + d.
    pub slope: Vector2<T>,
}

/// The three axes of a plane, orthonormal and right-handed.
#[derive(Debug, Clone, Copy)]
pub struct Axes<T> {
    /// The base's x axis, projected onto the plane.
    pub forward: Vector3<T>,
    /// To the left.
    pub left: Vector3<T>,
    /// Upwards.
    pub normal: Vector3<T>,
}

impl<T: Real> Axes<T> {
    /// Axes of the plane z = a x + b y + d: n = (-a, -b, 1) / s; forward is the base's x axis minus its
    /// component along n, normalised.
    pub fn of(slope: &Vector2<T>) -> Self {
        let s = length(*slope);
        let normal = Vector3::new(-slope.x / s, -slope.y / s, T::one() / s);
        let along = T::one() / (normal.y * normal.y + normal.z * normal.z).sqrt();
        let forward = Vector3::new(
            T::one() - normal.x * normal.x,
            -normal.x * normal.y,
            -normal.x * normal.z,
        ) * along;
        let left = normal.cross(&forward);
        Self {
            forward,
            left,
            normal,
        }
    }
}

impl<T: Real> ContactPlane<T> {
    /// Newton steps for wheels of different radii. Each squares the error, which starts near 1e-3 for a slope
    /// of 0.1 and radii that differ by a tenth.
    const NEWTON_STEPS: usize = 3;

    /// The plane with n . c_i - R_i = height for all wheels, in the least-squares sense (exact for three
    /// wheels, and for any number of wheels on flat ground).
    ///
    /// With n = (-a, -b, 1) / s and s^2 = 1 + a^2 + b^2 this reads z_i - s R_i = a x_i + b y_i + d. With m =
    /// (a, b), rho the centres relative to their mean, S = sum rho rho', q = sum rho R, the normal equations
    /// S m + s q = sum rho z are linear for equal radii (q = 0). The Newton step is
    /// ```text
    ///     (S + q m' / s) m_next = sum rho z - q / s
    /// ```
    pub fn through(centres: &[Vector3<T>], radii: &[T], radii_differ: bool) -> Self {
        let slope = Self::slope_through(centres, radii, radii_differ);
        Self::with_axes(slope, Axes::of(&slope), centres, radii)
    }

    /// a and b of this plane.
    #[inline(always)]
    pub fn slope_through(centres: &[Vector3<T>], radii: &[T], radii_differ: bool) -> Vector2<T> {
        let fit = Fit::of(centres, radii);
        let mut slope = Vector2::new(T::zero(), T::zero());
        for _ in 0..if radii_differ { Self::NEWTON_STEPS } else { 1 } {
            slope = fit.improved(&slope);
        }
        slope
    }

    /// The plane with this slope and these axes, at its height.
    #[inline(always)]
    pub fn with_axes(
        slope: Vector2<T>,
        axes: Axes<T>,
        centres: &[Vector3<T>],
        radii: &[T],
    ) -> Self {
        let Axes {
            forward,
            left,
            normal,
        } = axes;
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
            slope,
        }
    }

    /// Coordinates of a point along the plane's axes, relative to the projected base origin (m).
    pub fn coordinates(&self, point: &Vector3<T>) -> Vector2<T> {
        Vector2::new(self.forward.dot(point), self.left.dot(point))
    }
}

/// s = sqrt(1 + a^2 + b^2)
pub(crate) fn length<T: Real>(slope: Vector2<T>) -> T {
    (T::one() + slope.x * slope.x + slope.y * slope.y).sqrt()
}

/// Sums of the normal equations.
struct Fit<T> {
    xx: T,
    xy: T,
    yy: T,
    /// sum rho z
    z: Vector2<T>,
    /// q = sum rho R
    radius: Vector2<T>,
}

impl<T: Real> Fit<T> {
    fn of(centres: &[Vector3<T>], radii: &[T]) -> Self {
        let share = T::constant(1.0 / centres.len() as f64);
        let mean = centres.iter().fold(zero(), |sum: Vector3<T>, c| sum + c) * share;
        let zero = Vector2::new(T::zero(), T::zero());
        let mut fit = Self {
            xx: T::zero(),
            xy: T::zero(),
            yy: T::zero(),
            z: zero,
            radius: zero,
        };
        for (c, &radius) in centres.iter().zip(radii) {
            let r = c - mean;
            fit.xx += r.x * r.x;
            fit.xy += r.x * r.y;
            fit.yy += r.y * r.y;
            fit.z += Vector2::new(r.x * r.z, r.y * r.z);
            fit.radius += Vector2::new(r.x * radius, r.y * radius);
        }
        fit
    }

    fn improved(&self, slope: &Vector2<T>) -> Vector2<T> {
        let per_s = T::one() / length(*slope);
        let q = self.radius * per_s;
        let (xx, xy) = (self.xx + q.x * slope.x, self.xy + q.x * slope.y);
        let (yx, yy) = (self.xy + q.y * slope.x, self.yy + q.y * slope.y);
        let right = self.z - q;
        let determinant = xx * yy - xy * yx;
        Vector2::new(
            (yy * right.x - xy * right.y) / determinant,
            (xx * right.y - yx * right.x) / determinant,
        )
    }
}
