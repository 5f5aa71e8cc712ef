//! The result of an evaluation.

use nalgebra::Vector3;

use crate::closed_form::ClosedFormOutcome;
use crate::explain::attribution::{Contribution, Contributions};
use crate::explain::indicators::Indicators;
use crate::explain::uncertainty::Uncertainty;
use crate::geometry::spatial::Wrench;
use crate::machine::Machine;
use crate::number::Real;

/// Wheel loads and stability at one instant, or at several instants at once: see [`Real`].
///
/// NaN means that a value cannot be computed, and nothing else.
#[derive(Debug, Clone)]
pub struct Outcome<T> {
    /// Force and moment of the ground on the machine, about the base origin, in base axes (N, N m).
    pub ground_wrench: Wrench<T>,
    /// Unit normal of the plane through the contact points, pointing up, in base axes.
    pub contact_normal: Vector3<T>,
    /// Force of the ground along the normal: the sum of the loads (N).
    pub normal_force: T,
    /// Overturning force by wheel: its load if every wheel were held to the ground, OTF (109) of the first
    /// paper; negative where the ground would have to pull (N).
    pub otf: Vec<T>,
    /// Load by wheel (N), never negative.
    pub load: Vec<T>,
    /// Smallest load by wheel that equilibrium allows (N).
    pub load_least: Vec<T>,
    /// Largest load by wheel that equilibrium allows (N).
    pub load_largest: Vec<T>,
    /// Centre of pressure in the contact plane, forward of the projected base origin (m).
    pub zmp_x: T,
    /// Centre of pressure in the contact plane, left of the projected base origin (m).
    pub zmp_y: T,
    /// Distance of the centre of pressure from the nearest edge (m), positive inside the polygon.
    pub zmp_margin: T,
    /// Overturning moment about each edge of the support polygon, wheel weights included (the first paper's
    /// ITOM with wheel weights); negative = stable (N m).
    pub itom_full: Vec<T>,
    /// Number of measured torques of actuated joints that determined the load split.
    pub measured_torques: T,
    /// Residual of each measured torque: measured minus predicted, about its pivot (N m); NaN where
    /// unknown. Large residuals indicate an error of a sensor, of the machine description or of its traction.
    pub torque_residual: Vec<T>,
    /// Smallest closure of the linkages; not negative where all of them close.
    pub linkage_closure: T,
    /// Further measures of stability; NaN where the scope excludes them.
    pub indicators: Indicators<T>,
    /// Contributions to the load, by wheel.
    pub contributions: Vec<Contributions<T>>,
    /// Contribution of each link to the OTF, by link and wheel (N); empty where the scope excludes them.
    /// Minus the contribution of the tool wrench they add up to the OTF.
    pub parts: Vec<Vec<T>>,
    /// Standard deviations of the loads.
    pub uncertainty: Uncertainty<T>,
    /// Results of the analytic model beyond the loads; NaN with another model.
    pub closed_form: ClosedFormOutcome<T>,
}

impl<T: Real> Outcome<T> {
    pub(crate) fn blank(machine: &Machine) -> Self {
        let wheels = vec![T::zero(); machine.wheels.len()];
        Self {
            ground_wrench: Wrench::zero(),
            contact_normal: Vector3::zeros(),
            normal_force: T::zero(),
            otf: wheels.clone(),
            load: wheels.clone(),
            load_least: wheels.clone(),
            load_largest: wheels,
            zmp_x: T::zero(),
            zmp_y: T::zero(),
            zmp_margin: T::zero(),
            itom_full: vec![T::zero(); machine.polygon.edges.len()],
            measured_torques: T::zero(),
            torque_residual: vec![T::constant(f64::NAN); machine.contact.actuated_joints.len()],
            linkage_closure: T::zero(),
            indicators: Indicators::blank(machine),
            contributions: vec![
                [T::constant(f64::NAN); Contribution::ALL.len()];
                machine.wheels.len()
            ],
            parts: Vec::new(),
            uncertainty: Uncertainty::blank(machine),
            closed_form: ClosedFormOutcome::blank(machine),
        }
    }
}
