//! Scratch memory of an evaluation, allocated once per machine and reused by every step.

use std::sync::Arc;

use nalgebra::{Vector2, Vector3};

use crate::dynamics::groups::Groups;
use crate::dynamics::kinematics::BodyMotion;
use crate::evaluate::model::Model;
use crate::evaluate::outcome::Outcome;
use crate::evaluate::scope::Scope;
use crate::explain::sensitivity::{Sensitivity, SquareSums};
use crate::explain::uncertainty::ParameterSigmas;
use crate::geometry::coordinate::Coordinate;
use crate::geometry::spatial::Wrench;
use crate::machine::Machine;
use crate::number::Real;
use crate::wheel_loads::{Actuation, Equations, LoadAdjoints, Solver, TippingLine};

/// Reusable scratch memory of [`evaluate`](crate::evaluate) for one machine. A step does not allocate.
#[derive(Debug)]
pub struct Workspace<T: Real> {
    pub(crate) scope: Scope,
    pub(crate) model: Arc<Model>,
    pub(crate) coordinates: Vec<Coordinate<T>>,
    pub(crate) motions: Vec<BodyMotion<T>>,
    pub(crate) wrenches: Vec<Wrench<T>>,
    /// Wrench of the distal subtree of each joint with a known torque.
    pub(crate) distal: Vec<Wrench<T>>,
    pub(crate) actuations: Vec<Actuation<T>>,
    /// OTF by the split rule alone, where torques are measured (N).
    pub(crate) otf_by_rule: Vec<T>,
    pub(crate) wheel_centres: Vec<Vector3<T>>,
    /// Distance of each wheel's centre from the ground along the contact plane's normal (m).
    pub(crate) radii: Vec<T>,
    /// The loads that deflect the tyres (N).
    pub(crate) pressing: Vec<T>,
    pub(crate) contacts: Vec<Vector2<T>>,
    /// The lines about which the machine tips, by edge; none where these are the edges.
    pub(crate) tipping_lines: Vec<TippingLine<T>>,
    pub(crate) equations: Equations<T>,
    pub(crate) solver: Solver<T>,
    pub(crate) adjoints: LoadAdjoints<T>,
    pub(crate) groups: Groups<T>,
    pub(crate) sensitivity: Sensitivity<T>,
    pub(crate) sigmas: ParameterSigmas,
    /// Sums of the derivatives' squares over all evaluations, for who asks for them.
    pub(crate) squares: Option<SquareSums<T::Wheels>>,
    pub(crate) outcome: Outcome<T>,
}

impl<T: Real> Workspace<T> {
    /// Scratch memory for the loads of `machine`; with another machine it panics or gives wrong results.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        Self::with_scope(machine, Scope::LOADS)
    }

    /// Scratch memory for this scope, with the whole-body model.
    #[must_use]
    pub fn with_scope(machine: &Machine, scope: Scope) -> Self {
        Self::with_model(machine, scope, Arc::new(Model::WholeBody))
    }

    /// Scratch memory for this scope and model.
    #[must_use]
    pub fn with_model(machine: &Machine, scope: Scope, model: Arc<Model>) -> Self {
        let zero = Vector3::zeros();
        let (bodies, wheels) = (machine.bodies.len(), machine.wheels.len());
        let mut outcome = Outcome::blank(machine);
        if scope.parts {
            outcome.parts = vec![vec![T::zero(); wheels]; machine.links.len()];
        }
        Self {
            scope,
            model,
            coordinates: vec![Coordinate::slid(T::zero(), T::zero(), T::zero()); bodies],
            motions: vec![BodyMotion::base(zero, zero, zero); bodies],
            wrenches: vec![Wrench::zero(); bodies],
            distal: vec![Wrench::zero(); machine.contact.torque_joints().count()],
            actuations: vec![Actuation::unknown(); machine.contact.actuated_joints.len()],
            otf_by_rule: vec![T::zero(); wheels],
            wheel_centres: vec![zero; wheels],
            radii: vec![T::zero(); wheels],
            pressing: vec![T::zero(); wheels],
            contacts: vec![Vector2::zeros(); wheels],
            tipping_lines: Vec::with_capacity(machine.polygon.edges.len()),
            equations: Equations::new(machine),
            solver: Solver::new(machine, scope.needs_influences()),
            adjoints: LoadAdjoints::new(machine),
            groups: Groups::new(machine),
            sensitivity: Sensitivity::new(machine),
            sigmas: ParameterSigmas::of(machine),
            squares: None,
            outcome,
        }
    }

    /// The result of the last evaluation.
    #[must_use]
    pub fn outcome(&self) -> &Outcome<T> {
        &self.outcome
    }

    /// Centres of the wheels at the last evaluation, in the base frame (m).
    #[must_use]
    pub fn wheel_centres(&self) -> &[Vector3<T>] {
        &self.wheel_centres
    }

    /// Distances of the wheels' centres from the ground at the last evaluation (m).
    #[must_use]
    pub fn radii(&self) -> &[T] {
        &self.radii
    }

    /// A point that is fixed to a body at the last evaluation, in the base frame (m).
    #[must_use]
    pub fn point(&self, body: usize, in_body: &Vector3<f64>) -> Vector3<T> {
        self.motions[body].point(in_body)
    }

    /// Variance of a weighted sum of the OTF that the split leaves: by measured torques, and by side forces (N^2).
    pub(crate) fn split_variance(&self, factors: &[T]) -> T {
        let mut variance = T::zero();
        let response = self.solver.otf_response();
        if self.equations.are_measured() {
            for (i, &a) in factors.iter().enumerate() {
                for (j, &b) in factors.iter().enumerate() {
                    variance += a * b * response.slack(&self.equations, i, j);
                }
            }
            variance *= self.equations.prior_variance();
            variance += self.equations.variance_by_supports(factors);
        }
        let of_row = |row: usize| {
            let loads = factors.iter().zip(&response.loads[row]);
            loads.fold(T::zero(), |sum, (&factor, &load)| sum + factor * load)
        };
        variance.max(T::zero()) + self.equations.side_variance(of_row)
    }

    /// The derivatives from the last evaluation, if its scope includes them.
    #[must_use]
    pub fn sensitivity(&self) -> &Sensitivity<T> {
        &self.sensitivity
    }
}
