//! Closed triangles: a linear actuator (cylinder hinge, rod) that turns a pivot.
//!
//! The corners of the triangle are the pivot T, the cylinder's hinge C and the rod's eye E. In the plane
//! perpendicular to the pivot's axis, seen from the body that carries the cylinder, with d = T - C and
//! e(theta) = E - T rotated by the pivot angle theta:
//!
//! ```text
//!     v = d + e(theta)                              from hinge to eye
//!     |v|^2 = K + P cos(theta) + Q sin(theta)       law of cosines
//!     |v|^2 = X^2 + h^2                             X along the rod, h its eccentricity
//!     x = X - X0                                    cylinder stroke
//! ```
//!
//! Either theta or x is measured. The other one, the cylinder's angle, and the first and second time
//! derivatives of all three follow exactly and without inverse trigonometric functions: angles are
//! represented by cosine and sine. (Second paper (11)-(19), corrected; the same closure for any geometry.)

use nalgebra::{Isometry3, Point3, Vector2, Vector3};

use super::body::JointKind;
use super::error::MachineError;
use super::spec::LinkageSpec;
use super::tree::Tree;
use crate::geometry::coordinate::{Coordinate, Motion};
use crate::number::Real;

/// Deviation allowed between axes that should be parallel or perpendicular (dimensionless).
const AXIS_TOLERANCE: f64 = 1e-3;
/// Distance that a stroke keeps from a dead centre, relative to the actuator's length: some 0.05 degrees of the pivot.
const DEAD_CENTRE_SHARE: f64 = 1e-7;
/// Out-of-plane distance allowed between eye and pin, relative to the size of the triangle.
const OUT_OF_PLANE_SHARE: f64 = 0.01;

/// A closed triangle of the machine.
#[derive(Debug, Clone)]
pub struct Linkage {
    /// Name in the machine file.
    pub name: String,
    /// The side that the log measures.
    pub input: LinkageInput,
    /// Index of the measured joint.
    pub measured_joint: usize,
    /// The bodies moved by its joints.
    pub bodies: LinkageBodies,
    /// The fixed geometry.
    geometry: Triangle,
}

/// The side of a triangle that a log measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkageInput {
    /// The pivot's angle (rad).
    PivotAngle,
    /// The rod's coordinate (m).
    RodLength,
}

/// Motion of the triangle's three joints.
#[derive(Debug, Clone, Copy)]
pub struct LinkageMotion<T> {
    /// The pivot.
    pub pivot: Coordinate<T>,
    /// The cylinder's hinge.
    pub cylinder: Coordinate<T>,
    /// The rod.
    pub rod: Coordinate<T>,
    /// Square of the length or sine that closure requires: not negative where the triangle closes.
    pub closure: T,
}

/// The symbols of the module documentation. In the plane, x is along the rod at cylinder angle zero and y
/// completes a right-handed pair about the pivot's axis.
#[derive(Debug, Clone, Copy)]
struct Triangle {
    /// Vector from the hinge to the pivot (m).
    d: Vector2<f64>,
    /// Vector from the pivot to the eye at pivot angle zero (m).
    e0: Vector2<f64>,
    /// Eccentricity h: y of the eye at cylinder angle zero (m).
    eccentricity: f64,
    /// X at zero stroke (m).
    length_at_zero: f64,
    /// +1 if a positive pivot angle turns e counter-clockwise in the plane, else -1.
    pivot_sign: f64,
    /// +1 if a positive angle of the cylinder's hinge turns the cylinder counter-clockwise in the plane, else -1.
    cylinder_sign: f64,
    /// Sign of sin(theta - theta_0), theta_0 the pivot angle at the longest actuator: selects the branch.
    branch: f64,
    /// K, P and Q of the law of cosines (m^2); Q includes the sign of the pivot.
    k: f64,
    p: f64,
    q: f64,
}

impl Linkage {
    /// Scales the distances from hinge to pivot and from pivot to eye.
    pub(super) fn scale_sides(&mut self, hinge_to_pivot: f64, pivot_to_eye: f64) {
        let t = &mut self.geometry;
        t.d *= hinge_to_pivot;
        t.e0 *= pivot_to_eye;
        t.k = t.d.norm_squared() + t.e0.norm_squared();
        t.p *= hinge_to_pivot * pivot_to_eye;
        t.q *= hinge_to_pivot * pivot_to_eye;
    }

    /// The pivot's angle (rad) for a cylinder stroke (m); NaN where the triangle cannot close.
    pub(super) fn pivot_at_rod(&self, rod: f64) -> f64 {
        let pivot = self.geometry.by_rod(&Motion::at_rest(rod)).pivot;
        Real::atan2(pivot.sin, pivot.cos)
    }

    /// The cylinder stroke (m) at an angle of the pivot (rad); NaN where the triangle cannot close. At a dead
    /// centre the stroke stops short of it, because the angle does not follow from it there.
    pub(super) fn rod_at_pivot(&self, pivot: f64) -> f64 {
        let (sin, cos) = Real::sin_cos(pivot);
        let rod = self.geometry.by_pivot(cos, sin, 0.0, 0.0).rod.displacement;
        let length = rod + self.geometry.length_at_zero;
        let stops = [0.0, -DEAD_CENTRE_SHARE, DEAD_CENTRE_SHARE].map(|share| rod + share * length);
        let closes = |rod: &f64| self.pivot_at_rod(*rod).is_finite();
        stops.into_iter().find(closes).unwrap_or(rod)
    }

    /// Motion of the three joints from that of the rod.
    #[inline]
    pub fn solve_by_rod<T: Real>(&self, rod: &Motion<T>) -> LinkageMotion<T> {
        self.geometry.by_rod(rod)
    }

    /// Motion of the three joints from that of the measured one.
    pub fn solve<T: Real>(&self, measured: &Motion<T>) -> LinkageMotion<T> {
        match self.input {
            LinkageInput::PivotAngle => {
                let (sin, cos) = measured.position.sin_cos();
                self.geometry
                    .by_pivot(cos, sin, measured.rate, measured.acceleration)
            }
            LinkageInput::RodLength => self.geometry.by_rod(measured),
        }
    }

    /// Motion of the measured joint from that of the rod.
    pub fn measured_by_rod(&self, rod: &Motion<f64>) -> Motion<f64> {
        if self.input == LinkageInput::RodLength {
            return *rod;
        }
        let pivot = self.geometry.by_rod(rod).pivot;
        Motion {
            position: Real::atan2(pivot.sin, pivot.cos),
            rate: pivot.rate,
            acceleration: pivot.acceleration,
        }
    }
}

impl Triangle {
    fn by_pivot<T: Real>(&self, cos: T, sin: T, rate: T, acceleration: T) -> LinkageMotion<T> {
        let c = T::constant;
        // s = |v|^2 and its derivatives with respect to theta
        let s = c(self.k) + cos.scaled(self.p) + sin.scaled(self.q);
        let s1 = cos.scaled(self.q) - sin.scaled(self.p);
        let s2 = c(self.k) - s;
        let closure = s - c(self.eccentricity * self.eccentricity);
        let length = closure.sqrt();
        // X^2 = s - h^2, differentiated twice
        let half = c(0.5);
        let length_rate = half * s1 * rate / length;
        let s_acceleration = s2 * rate * rate + s1 * acceleration;
        let length_acceleration = (half * s_acceleration - length_rate * length_rate) / length;
        let pivot = Coordinate::turned(cos, sin, rate, acceleration);
        self.complete(
            pivot,
            length,
            length_rate,
            length_acceleration,
            s,
            s1 * rate,
            closure,
        )
    }

    fn by_rod<T: Real>(&self, rod: &Motion<T>) -> LinkageMotion<T> {
        let c = T::constant;
        let length = rod.position + c(self.length_at_zero);
        let s = length * length + c(self.eccentricity * self.eccentricity);
        // P cos(theta) + Q sin(theta) = M cos(theta - theta_0) = s - K
        let m = (self.p * self.p + self.q * self.q).sqrt();
        let (cos0, sin0) = (self.p / m, self.q / m);
        let cos_delta = (s - c(self.k)).scaled(1.0 / m);
        let closure = T::one() - cos_delta * cos_delta;
        let sin_delta = closure.sqrt().scaled(self.branch);
        let (cos, sin) = (
            cos_delta.scaled(cos0) - sin_delta.scaled(sin0),
            cos_delta.scaled(sin0) + sin_delta.scaled(cos0),
        );
        // 2 X Xdot = s1 thetadot, differentiated once more
        let s1 = cos.scaled(self.q) - sin.scaled(self.p);
        let s2 = c(self.k) - s;
        let s_rate = (length * rod.rate).scaled(2.0);
        let rate = s_rate / s1;
        let s_acceleration = (rod.rate * rod.rate + length * rod.acceleration).scaled(2.0);
        let acceleration = (s_acceleration - s2 * rate * rate) / s1;
        let pivot = Coordinate::turned(cos, sin, rate, acceleration);
        self.complete(
            pivot,
            length,
            rod.rate,
            rod.acceleration,
            s,
            s_rate,
            closure,
        )
    }

    /// The cylinder's angle phi rotates g = (X, h) onto v:
    /// cos(phi) = g.v / s, sin(phi) = g x v / s, phidot = (v x vdot + h Xdot) / s.
    #[expect(clippy::too_many_arguments, reason = "the quantities of one equation")]
    fn complete<T: Real>(
        &self,
        pivot: Coordinate<T>,
        length: T,
        length_rate: T,
        length_acceleration: T,
        s: T,
        s_rate: T,
        closure: T,
    ) -> LinkageMotion<T> {
        let c = T::constant;
        let sign = self.pivot_sign;
        let (cos, sin) = (pivot.cos, pivot.sin.scaled(sign));
        let (rate, acceleration) = (pivot.rate.scaled(sign), pivot.acceleration.scaled(sign));
        let (ex, ey) = (
            cos.scaled(self.e0.x) - sin.scaled(self.e0.y),
            sin.scaled(self.e0.x) + cos.scaled(self.e0.y),
        );
        let (vx, vy) = (c(self.d.x) + ex, c(self.d.y) + ey);
        let (vx_rate, vy_rate) = (-ey * rate, ex * rate);
        let vx_acceleration = -ey * acceleration - ex * rate * rate;
        let vy_acceleration = ex * acceleration - ey * rate * rate;
        let (gx, gy) = (length, self.eccentricity);
        let inverse = T::one() / s;
        let cylinder_rate = (vx * vy_rate - vy * vx_rate + length_rate.scaled(gy)) * inverse;
        let cylinder_acceleration = (vx * vy_acceleration - vy * vx_acceleration
            + length_acceleration.scaled(gy)
            - cylinder_rate * s_rate)
            * inverse;
        let turn = self.cylinder_sign;
        LinkageMotion {
            pivot,
            cylinder: Coordinate::turned(
                (gx * vx + vy.scaled(gy)) * inverse,
                ((gx * vy - vx.scaled(gy)) * inverse).scaled(turn),
                cylinder_rate.scaled(turn),
                cylinder_acceleration.scaled(turn),
            ),
            rod: Coordinate::slid(
                length - c(self.length_at_zero),
                length_rate,
                length_acceleration,
            ),
            closure,
        }
    }
}

/// The bodies moved by a linkage's joints.
#[derive(Debug, Clone, Copy)]
pub struct LinkageBodies {
    /// Body of the pivot.
    pub pivot: usize,
    /// Body of the cylinder's hinge.
    pub cylinder: usize,
    /// Body of the rod.
    pub rod: usize,
}

/// Builds a linkage from its specification; `near` is an angle of the pivot (rad) on the side on which the machine works, `input` and `measured_joint` identify the logged joint.
///
/// # Errors
/// The triangle closes at no position, or the joints do not form a triangle.
pub(super) fn build(
    spec: &LinkageSpec,
    bodies: LinkageBodies,
    near: f64,
    input: LinkageInput,
    measured_joint: usize,
    tree: &Tree,
    file: &str,
) -> Result<Linkage, MachineError> {
    let geometry = Survey {
        spec,
        bodies,
        near,
        tree,
        file,
    }
    .triangle()?;
    Ok(Linkage {
        name: spec.name.clone(),
        input,
        measured_joint,
        bodies,
        geometry,
    })
}

/// Measures the triangle with all joints of the URDF at zero.
struct Survey<'a> {
    spec: &'a LinkageSpec,
    bodies: LinkageBodies,
    near: f64,
    tree: &'a Tree,
    file: &'a str,
}

impl Survey<'_> {
    fn fault(&self, expected: impl Into<String>, found: impl Into<String>) -> MachineError {
        MachineError::LinkageCannotClose {
            file: self.file.into(),
            linkage: self.spec.name.clone(),
            expected: expected.into(),
            found: found.into(),
        }
    }

    fn pose(&self, body: usize) -> &Isometry3<f64> {
        &self.tree.bodies[body].base_from_body
    }

    fn axis(&self, body: usize) -> Vector3<f64> {
        self.pose(body) * Vector3::z()
    }

    /// Checks the order of the bodies; returns +1 if the cylinder is mounted on the pivot's parent, -1 if on
    /// its child.
    fn cylinder_side(&self) -> Result<f64, MachineError> {
        let LinkageBodies {
            pivot,
            cylinder,
            rod,
        } = self.bodies;
        let bodies = &self.tree.bodies;
        let kind = |body: usize| bodies[body].joint.as_ref().map(|j| j.kind);
        if kind(pivot) != Some(JointKind::Revolute)
            || kind(cylinder) != Some(JointKind::Revolute)
            || kind(rod) != Some(JointKind::Prismatic)
        {
            return Err(self.fault(
                "a revolute pivot, a revolute cylinder and a prismatic rod",
                "joints of other types",
            ));
        }
        let body_of = |link: &str| self.tree.link(link).map(|l| self.tree.links[l].body);
        if bodies[rod].parent != cylinder || body_of(&self.spec.rod_end.link) != Some(rod) {
            return Err(self.fault(
                format!(
                    "rod \"{}\" to slide in cylinder \"{}\" and to carry rod_end",
                    self.spec.rod, self.spec.cylinder
                ),
                "a different order of joints",
            ));
        }
        let (carrier, anchor) = (bodies[cylinder].parent, body_of(&self.spec.anchor.link));
        if carrier == bodies[pivot].parent && anchor == Some(pivot) {
            Ok(1.0)
        } else if carrier == pivot && anchor == Some(bodies[pivot].parent) {
            Ok(-1.0)
        } else {
            Err(self.fault(
                format!(
                    "the cylinder on one side of pivot \"{}\" and the anchor on the other",
                    self.spec.pivot
                ),
                format!(
                    "the cylinder on \"{}\", the anchor on \"{}\"",
                    bodies[carrier].link, self.spec.anchor.link
                ),
            ))
        }
    }

    fn point(&self, point: &super::spec::PointSpec) -> Vector3<f64> {
        let Some(link) = self.tree.link(&point.link).map(|l| &self.tree.links[l]) else {
            return Vector3::repeat(f64::NAN);
        };
        (self.pose(link.body) * link.body_from_link * Point3::from(Vector3::from(point.xyz))).coords
    }

    fn triangle(&self) -> Result<Triangle, MachineError> {
        let pivot_sign = self.cylinder_side()?;
        let axis = self.axis(self.bodies.pivot);
        let hinge_axis = self.axis(self.bodies.cylinder);
        let rod_axis = self.axis(self.bodies.rod);
        if axis.cross(&hinge_axis).norm() > AXIS_TOLERANCE {
            return Err(self.fault(
                "the cylinder's hinge parallel to the pivot",
                format!("a deviation of {:.4}", axis.cross(&hinge_axis).norm()),
            ));
        }
        if rod_axis.dot(&axis).abs() > AXIS_TOLERANCE {
            return Err(self.fault(
                "the rod perpendicular to the pivot's axis",
                format!("a component of {:.4} along it", rod_axis.dot(&axis)),
            ));
        }
        let plane_x = (rod_axis - axis * rod_axis.dot(&axis)).normalize();
        let plane_y = axis.cross(&plane_x);
        let flat = |v: Vector3<f64>| Vector2::new(v.dot(&plane_x), v.dot(&plane_y));
        let (pivot, hinge) = (
            self.pose(self.bodies.pivot).translation.vector,
            self.pose(self.bodies.cylinder).translation.vector,
        );
        let (anchor, eye) = (
            self.point(&self.spec.anchor),
            self.point(&self.spec.rod_end),
        );
        let (d, e0) = (flat(pivot - hinge), flat(anchor - pivot));
        // x is along the rod, so X0 and h are the eye's coordinates at zero stroke.
        let eye_from_hinge = flat(eye - hinge);
        let triangle = Triangle {
            d,
            e0,
            eccentricity: eye_from_hinge.y,
            length_at_zero: eye_from_hinge.x,
            pivot_sign,
            cylinder_sign: hinge_axis.dot(&axis).signum(),
            branch: 1.0,
            k: d.norm_squared() + e0.norm_squared(),
            p: 2.0 * d.dot(&e0),
            q: 2.0 * pivot_sign * (d.y * e0.x - d.x * e0.y),
        };
        self.check_closure(&triangle, (eye - anchor).dot(&axis))?;
        Ok(Triangle {
            branch: self.branch(&triangle),
            ..triangle
        })
    }

    fn check_closure(&self, t: &Triangle, out_of_plane: f64) -> Result<(), MachineError> {
        let size = t.d.norm() + t.e0.norm();
        if !(t.d.norm() > 1e-6 && t.e0.norm() > 1e-6) {
            return Err(self.fault(
                "three distinct corners",
                format!(
                    "{:.6} m from hinge to pivot, {:.6} m from pivot to anchor",
                    t.d.norm(),
                    t.e0.norm()
                ),
            ));
        }
        if !(out_of_plane.abs() <= OUT_OF_PLANE_SHARE * size) {
            return Err(self.fault(
                "rod_end and anchor in one plane perpendicular to the pivot",
                format!("{out_of_plane:.4} m apart along its axis"),
            ));
        }
        let reach = [(t.d.norm() - t.e0.norm()).abs(), size];
        let limits = self.tree.bodies[self.bodies.rod]
            .joint
            .as_ref()
            .and_then(|j| j.limits);
        let [lower, upper] = limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let shortest = (lower + t.length_at_zero).max(0.0).hypot(t.eccentricity);
        let longest = (upper + t.length_at_zero).hypot(t.eccentricity);
        if upper + t.length_at_zero < 0.0 || shortest > reach[1] || longest < reach[0] {
            return Err(self.fault(
                format!(
                    "an actuator between {:.4} and {:.4} m long",
                    reach[0], reach[1]
                ),
                format!("{shortest:.4} to {longest:.4} m within the rod's limits"),
            ));
        }
        Ok(())
    }

    /// Returns the sign of the side of its longest position on which the actuator works.
    fn branch(&self, t: &Triangle) -> f64 {
        // sin(near - theta_0) has the sign of sin(near) P - cos(near) Q
        if self.near.sin() * t.p - self.near.cos() * t.q < 0.0 {
            -1.0
        } else {
            1.0
        }
    }
}
