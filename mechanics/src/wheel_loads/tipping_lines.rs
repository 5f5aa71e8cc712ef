//! The lines about which a machine tips over the edges of its polygon.
//!
//! Over an edge it tips about the line through the contacts of the edge's wheels. An axle that swings about a pivot, with wheels
//! on the edge and off it, stays on the ground with both. It turns freely, so the resultant of its wheels has no moment about the
//! pivot's axis: it passes through the point P where that axis crosses the axle, and meets the ground at p. The wheel at that end
//! of the line is replaced by P, and on the ground by p:
//! ```text
//!     P = o + z ((m - o).t / z.t),    t = z - n n.z        of an axis z through o, m midway between the axle's wheels
//!     p = sum of OTF_i p_i / sum of OTF_i                  over its wheels that press
//! ```
//! The machine begins to turn about the line through P, and the wheels off the edge lift, at the moment at which the zero moment
//! point reaches the line through p: both are on one line of action. The weight of the axle itself counts as if it hung at P, and
//! traction along the pivot's axis, which turns the axle across it, is left out of P: 1 mrad of an angle on ground that falls 1
//! degree along the axis.

use nalgebra::{Vector2, Vector3};

use crate::dynamics::kinematics::BodyMotion;
use crate::geometry::contact_plane::ContactPlane;
use crate::geometry::spatial::z_axis;
use crate::machine::{Edge, Machine, TorqueJoint};
use crate::number::Real;

/// The line about which a machine tips over an edge, from its start to its end, counter-clockwise seen from above.
#[derive(Debug, Clone, Copy)]
pub struct TippingLine<T> {
    /// Two points of it, in the base frame (m).
    pub through: [Vector3<T>; 2],
    /// The points in which the forces at these points meet the ground, along the axes of the contact plane (m).
    pub on_ground: [Vector2<T>; 2],
}

/// Inputs of a tipping line: a machine that stands.
pub(crate) struct Standing<'a, T: Real> {
    pub(crate) machine: &'a Machine,
    pub(crate) motions: &'a [BodyMotion<T>],
    pub(crate) plane: &'a ContactPlane<T>,
    /// The contact points in the plane.
    pub(crate) contacts: &'a [Vector2<T>],
    pub(crate) otf: &'a [T],
}

impl<T: Real> Standing<'_, T> {
    pub(crate) fn line(&self, edge: &Edge) -> TippingLine<T> {
        let end = |wheel: usize| {
            let mut axles = self.machine.axles_astride(edge);
            match axles.find(|axle| axle.supports_wheel[wheel]) {
                Some(axle) => (self.pivot(axle), self.pressed(axle)),
                None => (self.on_plane(&self.contacts[wheel]), self.contacts[wheel]),
            }
        };
        let [from, to] = [end(edge.from), end(edge.to)];
        TippingLine {
            through: [from.0, to.0],
            on_ground: [from.1, to.1],
        }
    }

    /// P
    fn pivot(&self, axle: &TorqueJoint) -> Vector3<T> {
        let motion = &self.motions[axle.body];
        let (axis, normal) = (z_axis(&motion.rotation), &self.plane.normal);
        let middle = self.on_plane(&self.weighted(axle, |_| T::one()).0);
        let along = axis - normal * normal.dot(&axis);
        let share = (middle - motion.origin).dot(&along) / axis.dot(&along);
        motion.origin + axis * share
    }

    /// p
    fn pressed(&self, axle: &TorqueJoint) -> Vector2<T> {
        let (at, sum) = self.weighted(axle, |wheel| self.otf[wheel].max(T::zero()));
        let (middle, _) = self.weighted(axle, |_| T::one());
        let presses = T::zero().lt(sum);
        Vector2::new(
            T::select(presses, at.x, middle.x),
            T::select(presses, at.y, middle.y),
        )
    }

    /// The mean of the contacts of an axle's wheels, and the sum of the weights.
    fn weighted(&self, axle: &TorqueJoint, weight: impl Fn(usize) -> T) -> (Vector2<T>, T) {
        let (mut sum, mut at) = (T::zero(), Vector2::new(T::zero(), T::zero()));
        for (wheel, contact) in self.contacts.iter().enumerate() {
            if axle.supports_wheel[wheel] {
                let weight = weight(wheel);
                sum += weight;
                at += contact * weight;
            }
        }
        (at / sum, sum)
    }

    fn on_plane(&self, at: &Vector2<T>) -> Vector3<T> {
        let plane = self.plane;
        plane.forward * at.x + plane.left * at.y + plane.normal * plane.height
    }
}
