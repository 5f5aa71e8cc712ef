//! Coupling of every joint to the measured joint that moves it.

use crate::geometry::coordinate::Coordinate;
use crate::machine::{Body, JointCoupling, Linkage, LinkageMotion, Machine};
use crate::number::{Dual, Real};
use crate::state::State;

/// Derivatives of a joint's coordinate with respect to the measured joint that it is coupled to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Following<T> {
    /// Derivative of the coordinate with respect to position; equal to velocity by velocity and acceleration by acceleration.
    pub(crate) coordinate: T,
    /// Derivative of the velocity with respect to position; half of acceleration by velocity.
    pub(super) rate: T,
    /// Derivative of the acceleration with respect to position.
    pub(super) acceleration: T,
}

impl<T: Real> Following<T> {
    /// Returns the derivatives of a joint that is a constant multiple of the measured one.
    pub(super) fn directly(factor: T) -> Self {
        Self {
            coordinate: factor,
            rate: T::zero(),
            acceleration: T::zero(),
        }
    }
}

/// The measured joint that a body's joint is coupled to.
pub(super) fn measured_by(machine: &Machine, body: usize) -> Option<usize> {
    match machine.bodies[body].coupling {
        JointCoupling::Root => None,
        JointCoupling::Measured(joint) | JointCoupling::Mimic { joint, .. } => Some(joint),
        JointCoupling::Pivot(linkage)
        | JointCoupling::Cylinder(linkage)
        | JointCoupling::Rod(linkage) => Some(machine.linkages[linkage].measured_joint),
    }
}

/// Coupling of pivot, cylinder and rod to the measured joint of the linkage.
pub(crate) fn followed_by<T: Real>(linkage: &Linkage, state: &State<T>) -> [Following<T>; 3] {
    let (_, followings) = solve_followed(linkage, state);
    followings
}

/// Motion of the joints of a linkage, from its own equations in dual numbers, and with it their coupling.
#[inline(always)]
pub(super) fn solve_followed<T: Real>(
    linkage: &Linkage,
    state: &State<T>,
) -> (LinkageMotion<T>, [Following<T>; 3]) {
    let mut measured = state.joints[linkage.measured_joint].map(Dual::fixed);
    measured.position.slope = T::one();
    let solved = linkage.solve(&measured);
    let turned = |c: &Coordinate<Dual<T>>| c.cos.value * c.sin.slope - c.sin.value * c.cos.slope;
    let following = |c: &Coordinate<Dual<T>>, coordinate: T| Following {
        coordinate,
        rate: c.rate.slope,
        acceleration: c.acceleration.slope,
    };
    let followings = [
        following(&solved.pivot, turned(&solved.pivot)),
        following(&solved.cylinder, turned(&solved.cylinder)),
        following(&solved.rod, solved.rod.displacement.slope),
    ];
    let value = |number: Dual<T>| number.value;
    let motion = LinkageMotion {
        pivot: solved.pivot.map(value),
        cylinder: solved.cylinder.map(value),
        rod: solved.rod.map(value),
        closure: value(solved.closure),
    };
    (motion, followings)
}

/// The coupling of every body's joint that does not change: not those of closed triangles.
pub(super) fn constant_followings<T: Real>(machine: &Machine) -> Vec<Following<T>> {
    let factor = |body: &Body| match body.coupling {
        JointCoupling::Measured(_) => 1.0,
        JointCoupling::Mimic { multiplier, .. } => multiplier,
        _ => 0.0,
    };
    let bodies = machine.bodies.iter();
    bodies
        .map(|body| Following::directly(T::constant(factor(body))))
        .collect()
}
