//! Derivatives of the contact plane with respect to the wheels' centres and radii.
//!
//! With rho_j the centre j in x and y relative to the mean, e_j its height above the plane, and s and (a, b)
//! as in the fit, differentiating the normal equations S (a, b) = sum rho_j zeta_j gives
//!
//! ```text
//!     (S + (sum rho_j R_j) (a, b)' / s) d(a, b) =
//!         sum rho_j (dz_j - s dR_j - (a, b).(dx_j, dy_j)) + e_j (dx_j, dy_j)
//! ```

use nalgebra::{Matrix2, Vector2, Vector3};

use crate::geometry::contact_plane::{Axes, ContactPlane, length};
use crate::geometry::spatial::zero;
use crate::number::{Dual, Real, Wheels};

/// Quantities for the derivatives of the plane, for one set of wheels.
pub(crate) struct PlaneDerivatives<T> {
    /// Derivatives of the axes with respect to a and b.
    axes: [Axes<T>; 2],
    /// Inverse of the matrix on the left-hand side.
    inverse: Matrix2<T>,
    slope: Vector2<T>,
    s: T,
    normal: Vector3<T>,
    mean_centre: Vector3<T>,
    count: T,
}

/// Derivatives of a scalar with respect to the plane's axes and height, treated as independent.
pub(crate) struct PlaneGradient<T> {
    pub(crate) forward: Vector3<T>,
    pub(crate) left: Vector3<T>,
    pub(crate) normal: Vector3<T>,
    pub(crate) height: T,
}

/// Derivatives of that scalar with respect to a and b, and to the height.
pub(crate) struct SlopeGradient<T> {
    /// With respect to the right-hand side of the normal equations.
    load: Vector2<T>,
    height_share: T,
}

impl<T: Real> PlaneDerivatives<T> {
    pub(crate) fn new(plane: &ContactPlane<T>, centres: &[Vector3<T>], radii: &[T]) -> Self {
        let count = T::constant(centres.len() as f64);
        let share = T::one() / count;
        let mean_centre = centres.iter().fold(zero(), |sum, c| sum + c) * share;
        let (slope, s) = (plane.slope, length(plane.slope));
        let o = T::zero();
        let (mut matrix, mut weighted) = (Matrix2::new(o, o, o, o), Vector2::new(o, o));
        for (centre, &radius) in centres.iter().zip(radii) {
            let rho = centre.xy() - mean_centre.xy();
            matrix += rho * rho.transpose();
            weighted += rho * radius;
        }
        matrix += weighted * slope.transpose() * (T::one() / s);
        let determinant = matrix.m11 * matrix.m22 - matrix.m12 * matrix.m21;
        let inverse = Matrix2::new(matrix.m22, -matrix.m12, -matrix.m21, matrix.m11)
            * (T::one() / determinant);
        Self {
            axes: [0, 1].map(|k| slopes_of(&Axes::of(&along(&slope, k)))),
            inverse,
            slope,
            s,
            normal: plane.normal,
            mean_centre,
            count,
        }
    }

    /// Converts derivatives with respect to axes and height into derivatives with respect to the fit, for the loads
    /// of several wheels side by side.
    pub(crate) fn gradient(&self, by: &PlaneGradient<T::Wheels>) -> SlopeGradient<T::Wheels> {
        let each = |v: &Vector3<T>| v.map(T::Wheels::each);
        // height = mean of n.c - R, so a change dn of the normal changes it by dn . mean centre
        let by_slope = self.axes.each_ref().map(|axes| {
            let by_normal = axes.normal.dot(&self.mean_centre);
            by.forward.dot(&each(&axes.forward))
                + by.left.dot(&each(&axes.left))
                + by.normal.dot(&each(&axes.normal))
                + by.height * T::Wheels::each(by_normal)
        });
        let [a, b] = by_slope;
        SlopeGradient {
            load: self.inverse.transpose().map(T::Wheels::each) * Vector2::new(a, b),
            height_share: by.height / T::Wheels::each(self.count),
        }
    }

    /// Derivatives with respect to a wheel's centre and radius.
    pub(crate) fn by_wheel(
        &self,
        by: &SlopeGradient<T::Wheels>,
        centre: &Vector3<T>,
        above_plane: T,
    ) -> (Vector3<T::Wheels>, T::Wheels) {
        let each = T::Wheels::each;
        let rho = (centre.xy() - self.mean_centre.xy()).map(each);
        let lever = by.load.dot(&rho);
        let across = by.load * each(above_plane) - self.slope.map(each) * lever;
        let moved = Vector3::new(across.x, across.y, lever);
        (
            moved + self.normal.map(each) * by.height_share,
            -(each(self.s) * lever) - by.height_share,
        )
    }

    /// Height of a wheel's lowest point above the fitted plane, in the measure of the fit.
    pub(crate) fn above_plane(&self, plane: &ContactPlane<T>, centre: &Vector3<T>, radius: T) -> T {
        (plane.normal.dot(centre) - radius - plane.height) * self.s
    }
}

/// The slope with its component `k` as the variable of differentiation.
fn along<T: Real>(slope: &Vector2<T>, k: usize) -> Vector2<Dual<T>> {
    let mut dual = slope.map(Dual::fixed);
    dual[k] = Dual::variable(slope[k]);
    dual
}

fn slopes_of<T: Real>(axes: &Axes<Dual<T>>) -> Axes<T> {
    let slopes = |v: &Vector3<Dual<T>>| v.map(|component| component.slope);
    Axes {
        forward: slopes(&axes.forward),
        left: slopes(&axes.left),
        normal: slopes(&axes.normal),
    }
}
