//! Force-Angle measure (Papadopoulos and Rey) and stability angles (Iagnemma and others).
//!
//! With p_c the centre of mass, l the shortest vector from it to an edge with unit vector a, and f and n the
//! force and moment about p_c that the ground must support, with opposite sign:
//! ```text
//!     f* = (1 - a a')(-f) + l x (a a')(-n) / |l|^2
//!     angle from l to f* about a, positive inside
//! ```

use nalgebra::{Vector2, Vector3};

use super::balance::Balance;
use crate::geometry::contact_plane::ContactPlane;
use crate::geometry::spatial::{Wrench, cross};
use crate::machine::Edge;
use crate::number::Real;

/// The machine above its support polygon.
#[derive(Debug)]
pub struct TippingAngles<'a, T: Real> {
    plane: &'a ContactPlane<T>,
    contacts: &'a [Vector2<T>],
    com: Vector3<T>,
}

impl<'a, T: Real> TippingAngles<'a, T> {
    pub(super) fn new(balance: &Balance<'a, T>, com: &Vector3<T>) -> Self {
        Self::over(balance.plane, balance.contacts, com)
    }

    /// With the centre of mass in base axes and the contact points in the axes of the contact plane.
    pub fn over(plane: &'a ContactPlane<T>, contacts: &'a [Vector2<T>], com: &Vector3<T>) -> Self {
        Self {
            plane,
            contacts,
            com: *com,
        }
    }

    /// Contact point of a wheel, in base axes.
    fn contact(&self, wheel: usize) -> Vector3<T> {
        let (plane, place) = (self.plane, &self.contacts[wheel]);
        plane.forward * place.x + plane.left * place.y + plane.normal * plane.height
    }

    /// Angle about an edge (rad) for the force and moment about the centre of mass that the ground must
    /// support; NaN for zero force.
    pub fn angle(&self, edge: &Edge, held: &Wrench<T>) -> T {
        let (from, to) = (self.contact(edge.from), self.contact(edge.to));
        let along = to - from;
        let a = along / along.dot(&along).sqrt();
        let across = |v: &Vector3<T>| v - a * a.dot(v);
        let l = across(&(to - self.com));
        let turning = a * -a.dot(&held.moment);
        let force = across(&-held.force) + cross(&l, &turning) / l.dot(&l);
        let angle = cross(&l, &force).dot(&a).atan2(l.dot(&force));
        // A zero force has no direction.
        let pushes = T::zero().lt(force.dot(&force));
        T::select(pushes, angle, T::constant(f64::NAN))
    }
}
