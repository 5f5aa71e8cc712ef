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
use crate::geometry::spatial::{Wrench, cross, each};
use crate::machine::Edge;
use crate::number::{Real, Wheels};
use crate::wheel_loads::TippingLine;

/// The machine above its support polygon.
#[derive(Debug)]
pub struct TippingAngles<'a, T: Real> {
    plane: &'a ContactPlane<T>,
    contacts: &'a [Vector2<T>],
    /// The lines about which the machine tips, by edge; none where these are the edges.
    lines: &'a [TippingLine<T>],
    com: Vector3<T>,
}

impl<'a, T: Real> TippingAngles<'a, T> {
    pub(super) fn new(balance: &Balance<'a, T>, com: &Vector3<T>) -> Self {
        Self {
            lines: balance.tipping_lines,
            ..Self::over(balance.plane, balance.contacts, com)
        }
    }

    /// Returns the tipping axes of a machine that tips about its edges, with the centre of mass in base axes and the contact
    /// points in the axes of the contact plane.
    pub fn over(plane: &'a ContactPlane<T>, contacts: &'a [Vector2<T>], com: &Vector3<T>) -> Self {
        Self {
            plane,
            contacts,
            lines: &[],
            com: *com,
        }
    }

    /// Angle about an edge (rad) for the force and moment about the centre of mass that the ground must
    /// support; NaN for zero force.
    pub fn angle(&self, edge: &Edge, held: &Wrench<T>) -> T {
        self.side_by_side(std::slice::from_ref(edge), &[], held)
            .wheel(0)
    }

    /// The angles about several edges: see [`Self::angle`].
    pub(super) fn fill(&self, edges: &[Edge], held: &Wrench<T>, angles: &mut [T]) {
        let count = T::Wheels::COUNT;
        let chunks = edges.chunks(count).zip(angles.chunks_mut(count));
        for (chunk, (edges, angles)) in chunks.enumerate() {
            let lines = self.lines.chunks(count).nth(chunk).unwrap_or_default();
            let found = self.side_by_side(edges, lines, held);
            for (place, angle) in angles.iter_mut().enumerate() {
                *angle = found.wheel(place);
            }
        }
    }

    /// The angles about as many edges as fit into a register.
    fn side_by_side(
        &self,
        edges: &[Edge],
        lines: &[TippingLine<T>],
        held: &Wrench<T>,
    ) -> T::Wheels {
        let [from, to] = match lines.is_empty() {
            true => [
                self.contacts_of(edges, |edge| edge.from),
                self.contacts_of(edges, |edge| edge.to),
            ],
            false => [0, 1].map(|end| ends_of(lines, end)),
        };
        let (moment, pushed) = (each(&held.moment), each(&-held.force));
        let along = to - from;
        let a = along / along.dot(&along).sqrt();
        let across = |v: &Vector3<T::Wheels>| v - a * a.dot(v);
        let l = across(&(to - each(&self.com)));
        let turning = a * -a.dot(&moment);
        let force = across(&pushed) + cross(&l, &turning) / l.dot(&l);
        let angle = cross(&l, &force).dot(&a).atan2(l.dot(&force));
        // A zero force has no direction.
        let pushes = T::Wheels::constant(0.0).lt(force.dot(&force));
        T::Wheels::select(pushes, angle, T::Wheels::constant(f64::NAN))
    }

    /// The contact points of one wheel of each edge, in base axes.
    fn contacts_of(&self, edges: &[Edge], wheel: impl Fn(&Edge) -> usize) -> Vector3<T::Wheels> {
        let place = |axis: usize| {
            T::Wheels::from_fn(|place| {
                let edge = edges.get(place);
                edge.map_or(T::zero(), |edge| self.contacts[wheel(edge)][axis])
            })
        };
        let plane = self.plane;
        each(&plane.forward) * place(0)
            + each(&plane.left) * place(1)
            + each(&(plane.normal * plane.height))
    }
}

/// The starts or the ends of some lines, in base axes.
fn ends_of<T: Real>(lines: &[TippingLine<T>], end: usize) -> Vector3<T::Wheels> {
    let place = |axis: usize| {
        T::Wheels::from_fn(|place| {
            let line = lines.get(place);
            line.map_or(T::zero(), |line| line.through[end][axis])
        })
    };
    Vector3::new(place(0), place(1), place(2))
}
