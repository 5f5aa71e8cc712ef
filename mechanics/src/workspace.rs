//! Scratch of an evaluation: made once for a machine, used again for every step.

use nalgebra::{Vector2, Vector3};

use crate::coordinate::Coordinate;
use crate::kinematics::BodyMotion;
use crate::machine::Machine;
use crate::number::Real;
use crate::outcome::Outcome;
use crate::spatial::Wrench;
use crate::wheel_loads::{Equations, Solver};

/// Reusable scratch of [`evaluate`](crate::evaluate), for one machine. A step allocates nothing.
#[derive(Debug)]
pub struct Workspace<T: Real> {
    pub(crate) coordinates: Vec<Coordinate<T>>,
    pub(crate) motions: Vec<BodyMotion<T>>,
    pub(crate) wrenches: Vec<Wrench<T>>,
    pub(crate) wheel_centres: Vec<Vector3<T>>,
    /// Distance of each wheel's centre from the ground, along the contact plane's normal (m).
    pub(crate) radii: Vec<T>,
    pub(crate) contacts: Vec<Vector2<T>>,
    pub(crate) equations: Equations<T>,
    pub(crate) solver: Solver<T>,
    pub(crate) outcome: Outcome<T>,
}

impl<T: Real> Workspace<T> {
    /// Scratch for `machine`; using it with another one panics or gives nonsense.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        let zero = Vector3::zeros();
        let bodies = machine.bodies.len();
        Self {
            coordinates: vec![Coordinate::slid(T::zero(), T::zero(), T::zero()); bodies],
            motions: vec![BodyMotion::base(zero, zero, zero); bodies],
            wrenches: vec![Wrench::zero(); bodies],
            wheel_centres: vec![zero; machine.wheels.len()],
            radii: vec![T::zero(); machine.wheels.len()],
            contacts: vec![Vector2::zeros(); machine.wheels.len()],
            equations: Equations::new(machine),
            solver: Solver::new(machine),
            outcome: Outcome::blank(machine),
        }
    }
}
