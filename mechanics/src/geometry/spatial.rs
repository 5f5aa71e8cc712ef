//! Wrenches, and products of vectors and matrices that are fast for every number type.

use nalgebra::{Matrix3, Vector3};

use crate::number::{Real, Wheels};

/// A force and its moment about a stated point, in stated axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrench<T> {
    /// Force (N).
    pub force: Vector3<T>,
    /// Moment (N m).
    pub moment: Vector3<T>,
}

impl<T: Real> Wrench<T> {
    /// Zero force and moment.
    #[must_use]
    #[inline]
    pub fn zero() -> Self {
        Self {
            force: zero(),
            moment: zero(),
        }
    }

    /// The sum of two wrenches about the same point.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            force: self.force + other.force,
            moment: self.moment + other.moment,
        }
    }

    /// The difference of two wrenches about the same point.
    #[must_use]
    pub fn minus(&self, other: &Self) -> Self {
        Self {
            force: self.force - other.force,
            moment: self.moment - other.moment,
        }
    }

    /// Scalar product with coefficients: the sum of the products of corresponding components.
    pub fn contracted(&self, coefficients: &Self) -> T {
        self.force.dot(&coefficients.force) + self.moment.dot(&coefficients.moment)
    }

    /// [`Self::contracted`] with the coefficients of several wheels side by side.
    #[inline(always)]
    pub fn contracted_side_by_side(&self, coefficients: &Wrench<T::Wheels>) -> T::Wheels {
        each(&self.force).dot(&coefficients.force) + each(&self.moment).dot(&coefficients.moment)
    }

    /// Returns the wrench with its moment taken about `point`, given relative to the present point.
    #[must_use]
    pub fn about(&self, point: &Vector3<T>) -> Self {
        Self {
            force: self.force,
            moment: self.moment - point.cross(&self.force),
        }
    }
}

/// The vector of zeros. Written out, because nalgebra's takes ten times as long for lanes.
#[inline(always)]
pub fn zero<T: Real>() -> Vector3<T> {
    Vector3::new(T::zero(), T::zero(), T::zero())
}

/// The orientation of a frame with the same axes, written out as well.
#[inline(always)]
pub fn identity<T: Real>() -> Matrix3<T> {
    let (o, l) = (T::zero(), T::one());
    Matrix3::new(l, o, o, o, l, o, o, o, l)
}

/// The z axis of a frame with this orientation: the third column. Written out, as nalgebra's is a loop for lanes.
#[inline(always)]
pub fn z_axis<T: Real>(r: &Matrix3<T>) -> Vector3<T> {
    Vector3::new(r.m13, r.m23, r.m33)
}

/// R v. Written out, because nalgebra's general product takes twice as long for lanes.
#[inline(always)]
pub fn rotate<T: Real>(r: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        r.m11 * v.x + r.m12 * v.y + r.m13 * v.z,
        r.m21 * v.x + r.m22 * v.y + r.m23 * v.z,
        r.m31 * v.x + r.m32 * v.y + r.m33 * v.z,
    )
}

/// R' v.
#[inline(always)]
pub fn rotate_back<T: Real>(r: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        r.m11 * v.x + r.m21 * v.y + r.m31 * v.z,
        r.m12 * v.x + r.m22 * v.y + r.m32 * v.z,
        r.m13 * v.x + r.m23 * v.y + r.m33 * v.z,
    )
}

/// A B, column by column.
#[inline(always)]
pub fn compose<T: Real>(a: &Matrix3<T>, b: &Matrix3<f64>) -> Matrix3<T> {
    matrix(|i, j| {
        a[(i, 0)].scaled(b[(0, j)]) + a[(i, 1)].scaled(b[(1, j)]) + a[(i, 2)].scaled(b[(2, j)])
    })
}

/// Returns the matrix of these elements.
#[inline(always)]
pub fn matrix<T: Real>(at: impl Fn(usize, usize) -> T) -> Matrix3<T> {
    Matrix3::new(
        at(0, 0),
        at(0, 1),
        at(0, 2),
        at(1, 0),
        at(1, 1),
        at(1, 2),
        at(2, 0),
        at(2, 1),
        at(2, 2),
    )
}

/// R v for a constant v.
#[inline(always)]
pub fn rotate_constant<T: Real>(r: &Matrix3<T>, v: &Vector3<f64>) -> Vector3<T> {
    Vector3::new(
        r.m11.scaled(v.x) + r.m12.scaled(v.y) + r.m13.scaled(v.z),
        r.m21.scaled(v.x) + r.m22.scaled(v.y) + r.m23.scaled(v.z),
        r.m31.scaled(v.x) + r.m32.scaled(v.y) + r.m33.scaled(v.z),
    )
}

/// Returns a constant vector for every sample.
#[inline(always)]
pub fn constant<T: Real>(v: &Vector3<f64>) -> Vector3<T> {
    Vector3::new(T::constant(v.x), T::constant(v.y), T::constant(v.z))
}

/// Returns the vector for each of several wheels side by side.
#[inline(always)]
pub fn each<T: Real>(v: &Vector3<T>) -> Vector3<T::Wheels> {
    Vector3::new(
        T::Wheels::each(v.x),
        T::Wheels::each(v.y),
        T::Wheels::each(v.z),
    )
}

/// R' v of the vectors of several wheels side by side.
#[inline(always)]
pub fn rotate_each_back<T: Real>(r: &Matrix3<T>, v: &Vector3<T::Wheels>) -> Vector3<T::Wheels> {
    let each = T::Wheels::each;
    Vector3::new(
        each(r.m11) * v.x + each(r.m21) * v.y + each(r.m31) * v.z,
        each(r.m12) * v.x + each(r.m22) * v.y + each(r.m32) * v.z,
        each(r.m13) * v.x + each(r.m23) * v.y + each(r.m33) * v.z,
    )
}

/// R' v for a constant R.
#[inline(always)]
pub fn rotate_back_by_constant<T: Real>(r: &Matrix3<f64>, v: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        v.x.scaled(r.m11) + v.y.scaled(r.m21) + v.z.scaled(r.m31),
        v.x.scaled(r.m12) + v.y.scaled(r.m22) + v.z.scaled(r.m32),
        v.x.scaled(r.m13) + v.y.scaled(r.m23) + v.z.scaled(r.m33),
    )
}

/// a x b.
#[inline(always)]
pub fn cross<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        a.y * b.z - a.z * b.y,
        a.z * b.x - a.x * b.z,
        a.x * b.y - a.y * b.x,
    )
}
