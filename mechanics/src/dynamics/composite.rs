//! Mass moments and momenta of sets of bodies, about the base origin in base axes.
//!
//! Summed over all particles of mass m at r with velocity v:
//! ```text
//!     mass = sum m      first = sum m r      second = sum m r r'
//!     momentum = sum m v      swept = sum m r v'
//! ```
//! They are additive over bodies, whatever the joints between them, and sufficient for the derivatives of
//! the bodies' wrench.

use nalgebra::{Matrix3, Vector3};

use crate::dynamics::kinematics::BodyMotion;
use crate::geometry::spatial::{Wrench, compose, cross, rotate_constant, zero};
use crate::machine::MassMoments;
use crate::number::Real;

/// Moments of a set of bodies, see the module documentation.
#[derive(Debug, Clone, Copy)]
pub struct Composite<T> {
    /// (kg)
    pub mass: T,
    /// (kg m)
    pub first: Vector3<T>,
    /// Symmetric: xx, yy, zz, xy, xz, yz (kg m^2).
    pub second: [T; 6],
    /// (kg m/s)
    pub momentum: Vector3<T>,
    /// (kg m^2/s)
    pub swept: Matrix3<T>,
}

/// Inertial parameters of several bodies treated as one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InertialParameters<T> {
    /// (kg)
    pub(crate) mass: T,
    /// Centre of mass (m).
    pub(crate) centre: Vector3<T>,
    /// Inertia tensor about the centre of mass (kg m^2).
    pub(crate) tensor: Matrix3<T>,
}

/// The velocity field of a rigid motion: `v(r) = linear + angular x r`.
#[derive(Debug, Clone, Copy)]
pub struct Field<T> {
    /// Angular velocity.
    pub angular: Vector3<T>,
    /// Velocity at the base origin.
    pub linear: Vector3<T>,
}

impl<T: Real> Composite<T> {
    /// No bodies.
    #[inline(always)]
    pub fn zero() -> Self {
        let o = T::zero();
        Self {
            mass: o,
            first: zero(),
            second: [o; 6],
            momentum: zero(),
            swept: Matrix3::new(o, o, o, o, o, o, o, o, o),
        }
    }

    /// The moments of a rigid body, given in its own frame, with the motion `motion`.
    #[inline(always)]
    pub fn of(body: &MassMoments, motion: &BodyMotion<T>) -> Self {
        let mut composite = Self::zero();
        composite.set(body, motion);
        composite
    }

    /// [`Self::of`] in its place, without a copy.
    #[inline(always)]
    pub(crate) fn set(&mut self, body: &MassMoments, motion: &BodyMotion<T>) {
        let Self {
            mass,
            first,
            second: second @ [xx, yy, zz, xy, xz, yz],
            ..
        } = Self::at_rest(body, motion);
        let Field {
            angular: w,
            linear: v,
        } = motion.velocity_field();
        self.mass = mass;
        self.first = first;
        self.second = second;
        self.momentum = v * mass + cross(&w, &first);
        // row a of sum m r v' is h_a v_0 + w x (row a of sum m r r')
        let row = |h: T, s: Vector3<T>| v * h + cross(&w, &s);
        let x = row(first.x, Vector3::new(xx, xy, xz));
        let y = row(first.y, Vector3::new(xy, yy, yz));
        let z = row(first.z, Vector3::new(xz, yz, zz));
        self.swept = Matrix3::new(x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z);
    }

    /// Returns the moments of a body at rest: its spatial inertia transformed to the base origin, one term of (21) of the second
    /// paper.
    #[inline(always)]
    pub fn at_rest(body: &MassMoments, pose: &BodyMotion<T>) -> Self {
        let (r, o) = (&pose.rotation, &pose.origin);
        let mass = T::constant(body.mass);
        let first = rotate_constant(r, &body.first);
        // R S R' + o h' + h o' + m o o'
        let turned = compose(r, &body.second);
        let shifted = first + o * mass;
        let at = |i: usize, j: usize| {
            turned[(i, 0)] * r[(j, 0)]
                + turned[(i, 1)] * r[(j, 1)]
                + turned[(i, 2)] * r[(j, 2)]
                + o[i] * first[j]
                + shifted[i] * o[j]
        };
        Self {
            mass,
            first: shifted,
            second: [at(0, 0), at(1, 1), at(2, 2), at(0, 1), at(0, 2), at(1, 2)],
            ..Self::zero()
        }
    }

    /// Mass, centre of mass and inertia tensor about it of all bodies treated as one, (23)-(25) of the second
    /// paper:
    ///
    /// ```text
    ///     m = M(1,1)      r = [M(6,2) M(4,3) M(5,1)] / m      I = M(4:6,4:6) + m [r]^2
    /// ```
    /// With the second moments S about the origin: I = tr(S_c) - S_c, where S_c = S - m r r'.
    pub(crate) fn inertial_parameters(&self) -> InertialParameters<T> {
        let centre = self.first * (T::one() / self.mass);
        let [xx, yy, zz, xy, xz, yz] = self.second;
        let less = |moment: T, i: usize, j: usize| moment - self.first[i] * centre[j];
        let (xx, yy, zz) = (less(xx, 0, 0), less(yy, 1, 1), less(zz, 2, 2));
        let (xy, xz, yz) = (-less(xy, 0, 1), -less(xz, 0, 2), -less(yz, 1, 2));
        InertialParameters {
            mass: self.mass,
            centre,
            tensor: Matrix3::new(yy + zz, xy, xz, xy, xx + zz, yz, xz, yz, xx + yy),
        }
    }

    /// Adds the moments of other bodies.
    #[inline(always)]
    pub fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.first += other.first;
        for (sum, &more) in self.second.iter_mut().zip(&other.second) {
            *sum += more;
        }
        self.momentum += other.momentum;
        self.swept += other.swept;
    }

    /// Returns the moments with this share of the bodies' mass.
    pub fn scaled(&self, share: T) -> Self {
        Self {
            mass: self.mass * share,
            first: self.first * share,
            second: self.second.map(|v| v * share),
            momentum: self.momentum * share,
            swept: self.swept * share,
        }
    }

    /// Wrench that gives all particles the acceleration of a field:
    /// `F = m a + alpha x h`, `M = h x a + sum m r x (alpha x r)`.
    #[inline(always)]
    pub fn accelerated(&self, field: &Field<T>) -> Wrench<T> {
        let (alpha, a) = (&field.angular, &field.linear);
        Wrench {
            force: a * self.mass + cross(alpha, &self.first),
            moment: cross(&self.first, a) + self.turned(alpha),
        }
    }

    /// Wrench of a uniform acceleration.
    #[inline(always)]
    pub(crate) fn uniformly_accelerated(&self, acceleration: &Vector3<T>) -> Wrench<T> {
        Wrench {
            force: acceleration * self.mass,
            moment: cross(&self.first, acceleration),
        }
    }

    /// Wrench of the bodies rotating together with w: centripetal and gyroscopic.
    pub fn spun(&self, w: &Vector3<T>) -> Wrench<T> {
        Wrench {
            force: cross(w, &cross(w, &self.first)),
            moment: cross(w, &self.turned(w)),
        }
    }

    /// I w = tr(S) w - S w
    #[inline(always)]
    fn turned(&self, w: &Vector3<T>) -> Vector3<T> {
        let [xx, yy, zz, xy, xz, yz] = self.second;
        Vector3::new(
            (yy + zz) * w.x - xy * w.y - xz * w.z,
            (xx + zz) * w.y - xy * w.x - yz * w.z,
            (xx + yy) * w.z - xz * w.x - yz * w.y,
        )
    }

    /// Wrench of the acceleration `2 w x v` of all particles.
    #[inline(always)]
    pub fn coriolis(&self, w: &Vector3<T>) -> Wrench<T> {
        let two = T::constant(2.0);
        let d = &self.swept;
        let trace = d.m11 + d.m22 + d.m33;
        let back = Vector3::new(
            d.m11 * w.x + d.m21 * w.y + d.m31 * w.z,
            d.m12 * w.x + d.m22 * w.y + d.m32 * w.z,
            d.m13 * w.x + d.m23 * w.y + d.m33 * w.z,
        );
        Wrench {
            force: cross(w, &self.momentum) * two,
            moment: (w * trace - back) * two,
        }
    }
}

impl<T: Real> Composite<T> {
    /// Wrench that produces the motion of a body with these moments: the acceleration field and w x v of every
    /// particle.
    pub fn moved(&self, motion: &BodyMotion<T>) -> Wrench<T> {
        let half = T::constant(0.5);
        let turning = self.coriolis(&motion.angular_velocity);
        self.accelerated(&motion.acceleration_field())
            .plus(&Wrench {
                force: turning.force * half,
                moment: turning.moment * half,
            })
    }
}

impl<T: Real> Field<T> {
    /// The velocity field of a unit rotation (1 rad/s) about an axis through a point.
    pub(crate) fn turning(axis: &Vector3<T>, point: &Vector3<T>) -> Self {
        Self {
            angular: *axis,
            linear: cross(point, axis),
        }
    }

    /// The velocity field of a uniform translation.
    pub(crate) fn sliding(direction: &Vector3<T>) -> Self {
        Self {
            angular: zero(),
            linear: *direction,
        }
    }

    /// Returns the field times a factor.
    pub fn scaled(&self, factor: T) -> Self {
        Self {
            angular: self.angular * factor,
            linear: self.linear * factor,
        }
    }

    /// Returns the value of the field at a point.
    pub(crate) fn at(&self, point: &Vector3<T>) -> Vector3<T> {
        self.linear + cross(&self.angular, point)
    }

    /// Time derivative of `other` when it is convected by this field.
    #[inline(always)]
    pub(crate) fn carries(&self, other: &Self) -> Self {
        Self {
            angular: cross(&self.angular, &other.angular),
            linear: cross(&self.angular, &other.linear) + cross(&self.linear, &other.angular),
        }
    }

    /// Time derivative of a wrench that is convected by this field.
    #[inline(always)]
    pub(crate) fn carries_wrench(&self, wrench: &Wrench<T>) -> Wrench<T> {
        Wrench {
            force: cross(&self.angular, &wrench.force),
            moment: cross(&self.angular, &wrench.moment) + cross(&self.linear, &wrench.force),
        }
    }

    pub(crate) fn minus(&self, other: &Self) -> Self {
        Self {
            angular: self.angular - other.angular,
            linear: self.linear - other.linear,
        }
    }
}

impl<T: Real> BodyMotion<T> {
    /// Velocity field of the body's points, with respect to the base origin.
    #[inline(always)]
    pub(crate) fn velocity_field(&self) -> Field<T> {
        Field {
            angular: self.angular_velocity,
            linear: self.velocity - cross(&self.angular_velocity, &self.origin),
        }
    }

    /// Spatial acceleration: the field whose value at r, with `w x v(r)` added, is the specific force there.
    #[inline(always)]
    pub(crate) fn acceleration_field(&self) -> Field<T> {
        Field {
            angular: self.angular_acceleration,
            linear: self.specific_force
                - cross(&self.angular_acceleration, &self.origin)
                - cross(&self.angular_velocity, &self.velocity),
        }
    }
}
