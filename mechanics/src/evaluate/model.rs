//! The choice between models of the ground wrench.

use crate::closed_form::{ClosedFormError, ClosedFormInput, PlacedPlatform, PlatformParts};
use crate::dynamics::kinematics::BodyMotion;
use crate::machine::Machine;
use crate::number::Real;

/// A model of the ground wrench. What follows from the wrench (loads, contact, envelope) is computed by the
/// same code for every model.
#[derive(Debug, Clone)]
pub enum Model {
    /// Newton-Euler equations over every body.
    WholeBody,
    /// An analytic model: that of the first paper, or of the second with recomputed inertia.
    ClosedForm(Box<ClosedForm>),
}

/// The analytic model of one machine: a rigid platform on four wheels, loaded by the wrench of the arm.
#[derive(Debug, Clone)]
pub struct ClosedForm {
    pub(crate) parts: PlatformParts,
    platform: PlatformSource,
    pub(crate) input: ClosedFormInput,
}

/// Source of the platform's parameters; the remaining equations are the same.
#[derive(Debug, Clone)]
enum PlatformSource {
    /// Constant, from one posture: the first paper.
    Frozen(Box<PlacedPlatform<f64>>),
    /// Recomputed for every posture as linkages and steering move: the second paper.
    Variable,
}

impl ClosedForm {
    /// The first paper's model of `machine`: constant inertial parameters and wheel distances, from the posture
    /// with these joint positions (rad or m) in the order of [`Machine::joints`] and the cylinders of an active
    /// suspension at mid-stroke.
    ///
    /// # Errors
    /// [`ClosedFormError`]: the analytic model does not apply to the machine.
    pub fn new(
        machine: &Machine,
        joint_positions: &[f64],
        input: ClosedFormInput,
    ) -> Result<Self, ClosedFormError> {
        let parts = PlatformParts::of(machine)?;
        let placed = parts.place(machine, &machine.at_mid_stroke(joint_positions))?;
        Ok(Self {
            parts,
            platform: PlatformSource::Frozen(Box::new(placed)),
            input,
        })
    }

    /// The second paper's model: mass, centre of mass, inertia tensor, wheel distances, half tracks and the
    /// arm's root follow the joints, sample by sample. The joint positions serve only to check that the
    /// wheels form a rectangle there.
    ///
    /// # Errors
    /// Those of [`ClosedForm::new`].
    pub fn with_variable_inertia(
        machine: &Machine,
        joint_positions: &[f64],
        input: ClosedFormInput,
    ) -> Result<Self, ClosedFormError> {
        let parts = PlatformParts::of(machine)?;
        parts.place(machine, joint_positions)?;
        Ok(Self {
            parts,
            platform: PlatformSource::Variable,
            input,
        })
    }

    /// Returns the signals from which the model takes the platform's acceleration.
    #[must_use]
    pub fn input(&self) -> ClosedFormInput {
        self.input
    }

    /// The platform at a given pose of all bodies.
    pub(crate) fn placed<T: Real>(
        &self,
        machine: &Machine,
        motions: &[BodyMotion<T>],
    ) -> PlacedPlatform<T> {
        match &self.platform {
            PlatformSource::Frozen(placed) => PlacedPlatform::constant(placed),
            PlatformSource::Variable => self.parts.placed(machine, motions),
        }
    }
}
