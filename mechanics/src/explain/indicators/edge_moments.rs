//! Overturning moments about the edges of the support polygon: MHS-type (moment height stability), TOM
//! (tip-over moment), ITOM (improved tip-over moment).
//!
//! Each is the moment about the edge of the wrench that the ground must support for a subset of the bodies,
//! with the sign of the first paper: negative = stable. The subsets follow the flags in its (44)-(45):
//!
//! ```text
//!     MHS-type   arm and tool force
//!     TOM        arm, tool force, chassis weight
//!     ITOM       arm, tool force, all chassis terms; massless wheels
//! ```
//! ITOM with wheel weights is [`Outcome::itom_full`](crate::Outcome): the moment of all bodies.

use nalgebra::{Vector2, Vector3};

use super::balance::Balance;
use super::values::Indicators;
use crate::geometry::spatial::Wrench;
use crate::number::Real;
use crate::wheel_loads::GroundForce;

/// Overturning moment about a line on the ground of a wrench that the ground must support: with e the unit vector of the
/// line, counter-clockwise, starting at p, M = -(e . (M_xy + p x F_n)).
pub(crate) fn overturning<T: Real>(force: &GroundForce<T>, [from, to]: [Vector2<T>; 2]) -> T {
    let along = to - from;
    let length = along.dot(&along).sqrt();
    let inward = along.x * (force.moment.x - force.normal * from.y)
        + along.y * (force.moment.y + force.normal * from.x);
    -inward / length
}

pub(super) fn fill<T: Real>(
    balance: &Balance<'_, T>,
    gravity: &Vector3<T>,
    ground: &Wrench<T>,
    out: &mut Indicators<T>,
) {
    let parts = balance.whole;
    let arm = parts.arm.wrench.minus(&parts.tool);
    let weight = parts.chassis.moments.uniformly_accelerated(gravity);
    let of = |wrench: &Wrench<T>| GroundForce::in_plane(wrench, balance.plane);
    let (mhs, tom, itom) = (
        of(&arm),
        of(&arm.plus(&weight)),
        of(&ground.minus(&parts.wheels.wrench)),
    );
    for (i, edge) in balance.machine.polygon.edges.iter().enumerate() {
        let line = match balance.tipping_lines.get(i) {
            Some(line) => line.on_ground,
            None => [edge.from, edge.to].map(|wheel| balance.contacts[wheel]),
        };
        out.mhs[i] = overturning(&mhs, line);
        out.tom[i] = overturning(&tom, line);
        out.itom[i] = overturning(&itom, line);
    }
}
