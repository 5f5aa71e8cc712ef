//! Coupling of every joint to the measured joint that moves it.

use crate::geometry::coordinate::Coordinate;
use crate::machine::{JointCoupling, Linkage, Machine};
use crate::number::{Dual, Real};
use crate::state::State;

/// Derivatives of a joint's coordinate with respect to the measured joint that it is coupled to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Following<T> {
    /// Of the coordinate with respect to position; equal to velocity by velocity and acceleration by
    /// acceleration.
    pub(crate) coordinate: T,
    /// Of the velocity with respect to position; half of acceleration by velocity.
    pub(super) rate: T,
    /// Of the acceleration with respect to position.
    pub(super) acceleration: T,
}

impl<T: Real> Following<T> {
    /// Of a joint that is a constant multiple of the measured one.
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
    let mut measured = state.joints[linkage.measured_joint].map(Dual::fixed);
    measured.position.slope = T::one();
    let solved = linkage.solve(&measured);
    let turned = |c: &Coordinate<Dual<T>>| c.cos.value * c.sin.slope - c.sin.value * c.cos.slope;
    let following = |c: &Coordinate<Dual<T>>, coordinate: T| Following {
        coordinate,
        rate: c.rate.slope,
        acceleration: c.acceleration.slope,
    };
    [
        following(&solved.pivot, turned(&solved.pivot)),
        following(&solved.cylinder, turned(&solved.cylinder)),
        following(&solved.rod, solved.rod.displacement.slope),
    ]
}

/// Fills the coupling of every body's joint; for a closed triangle from its own equations in dual numbers.
pub(super) fn follow_measured<T: Real>(
    machine: &Machine,
    state: &State<T>,
    followings: &mut [Following<T>],
) {
    for (following, body) in followings.iter_mut().zip(&machine.bodies) {
        match body.coupling {
            JointCoupling::Measured(_) => *following = Following::directly(T::one()),
            JointCoupling::Mimic { multiplier, .. } => {
                *following = Following::directly(T::constant(multiplier));
            }
            _ => {}
        }
    }
    for linkage in &machine.linkages {
        let [pivot, cylinder, rod] = followed_by(linkage, state);
        followings[linkage.bodies.pivot] = pivot;
        followings[linkage.bodies.cylinder] = cylinder;
        followings[linkage.bodies.rod] = rod;
    }
}
