//! Mass, centre of mass and inertia tensor of a rigid body, with a check for physical validity.

use nalgebra::{Isometry3, Matrix3, SymmetricEigen, Vector3};

/// Rounded values in real URDFs violate the triangle inequality slightly: tolerance as a fraction of the
/// largest principal moment.
pub(super) const ROUNDING_SHARE: f64 = 1e-3;

/// Inertial parameters of a rigid body in some frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertia {
    /// Mass (kg).
    pub mass: f64,
    /// Centre of mass in the frame (m).
    pub com: Vector3<f64>,
    /// Inertia tensor about the centre of mass, axes of the frame (kg m^2).
    pub about_com: Matrix3<f64>,
}

/// Inertial parameters as moments about the origin of the frame, in which wrenches are linear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassMoments {
    /// Mass (kg).
    pub mass: f64,
    /// Mass times centre of mass (kg m).
    pub first: Vector3<f64>,
    /// Integral of r r' over the mass (kg m^2).
    pub second: Matrix3<f64>,
}

impl From<&Inertia> for MassMoments {
    fn from(inertia: &Inertia) -> Self {
        let central = Matrix3::identity() * (0.5 * inertia.about_com.trace()) - inertia.about_com;
        Self {
            mass: inertia.mass,
            first: inertia.com * inertia.mass,
            second: central + inertia.com * inertia.com.transpose() * inertia.mass,
        }
    }
}

/// The expected and the actual property of an invalid inertia.
pub(super) struct InertiaFault {
    pub(super) expected: &'static str,
    pub(super) found: String,
}

impl Inertia {
    /// Zero mass and inertia.
    #[must_use]
    pub fn zero() -> Self {
        Self {
            mass: 0.0,
            com: Vector3::zeros(),
            about_com: Matrix3::zeros(),
        }
    }

    /// Returns the body's parameters expressed in frame `a`, in which this frame has the pose `a_from_this`.
    #[must_use]
    pub fn transformed(&self, a_from_this: &Isometry3<f64>) -> Self {
        let rotation = a_from_this.rotation.to_rotation_matrix();
        Self {
            mass: self.mass,
            com: (a_from_this * nalgebra::Point3::from(self.com)).coords,
            about_com: rotation.matrix() * self.about_com * rotation.matrix().transpose(),
        }
    }

    /// Returns the parameters of both bodies rigidly connected, in their common frame.
    #[must_use]
    pub fn welded(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        if mass == 0.0 {
            return Self {
                about_com: self.about_com + other.about_com,
                ..*self
            };
        }
        let com = (self.com * self.mass + other.com * other.mass) / mass;
        let shifted = |body: &Self| {
            let d = body.com - com;
            body.about_com
                + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * body.mass
        };
        Self {
            mass,
            com,
            about_com: shifted(self) + shifted(other),
        }
    }

    /// A physical body has a positive mass and non-negative principal moments, none larger than the sum of the
    /// other two.
    pub(super) fn check(&self) -> Result<(), InertiaFault> {
        let fault = |expected, found: String| Err(InertiaFault { expected, found });
        if !(self.mass.is_finite()
            && self
                .com
                .iter()
                .chain(self.about_com.iter())
                .all(|v| v.is_finite()))
        {
            return fault("finite inertial parameters", format!("{self:?}"));
        }
        if self.mass < 0.0 || (self.mass == 0.0 && self.about_com != Matrix3::zeros()) {
            return fault(
                "a positive mass (or zero mass with zero inertia: a frame)",
                format!("mass {} kg", self.mass),
            );
        }
        let mut moments = SymmetricEigen::new(self.about_com).eigenvalues;
        moments.as_mut_slice().sort_by(f64::total_cmp);
        let [small, middle, large] = [moments[0], moments[1], moments[2]];
        let allowed = ROUNDING_SHARE * large.abs();
        if small < -allowed || large > small + middle + allowed {
            return fault(
                "non-negative principal moments of inertia, none larger than the sum of the other two",
                format!("{small:.6}, {middle:.6}, {large:.6} kg m^2"),
            );
        }
        Ok(())
    }
}
