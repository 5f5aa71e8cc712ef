//! Which model of the ground wrench the loads come from.

use crate::closed_form::{ClosedFormError, ClosedFormInput, PlacedPlatform, PlatformParts};
use crate::dynamics::kinematics::BodyMotion;
use crate::machine::Machine;
use crate::number::Real;

/// A model of the ground wrench. What follows from the wrench (loads, contact, envelope) is the same code
/// for all.
#[derive(Debug, Clone)]
pub enum Model {
    /// Newton-Euler over every body.
    WholeBody,
    /// An analytic model: the first paper's, or the second's with its inertia recomputed.
    ClosedForm(Box<ClosedForm>),
}

/// The analytic model for one machine: a rigid platform on four wheels, the arm as a wrench on it.
#[derive(Debug, Clone)]
pub struct ClosedForm {
    pub(crate) parts: PlatformParts,
    platform: PlatformSource,
    pub(crate) input: ClosedFormInput,
}

/// Where the platform's parameters come from: the equations after them are the same.
#[derive(Debug, Clone)]
enum PlatformSource {
    /// Constant, those of one posture: the first paper.
    Frozen(Box<PlacedPlatform<f64>>),
    /// Those of every posture, as linkages and steering move: the second paper.
    Variable,
}

impl ClosedForm {
    /// The first paper's model of `machine`: constant inertial parameters and wheel distances, those of
    /// the posture with its joints at these positions (rad or m), in the order of [`Machine::joints`],
    /// the rods of an active suspension in the middle of their stroke.
    ///
    /// # Errors
    /// [`ClosedFormError`]: the machine is not of the kind that the analytic model describes.
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

    /// The second paper's model: mass, centre of mass, inertia tensor, wheel distances, half tracks and
    /// the arm's base follow the joints, sample by sample. The positions are only to see whether the
    /// wheels stand in a rectangle there.
    ///
    /// # Errors
    /// As of [`ClosedForm::new`].
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

    /// Which signals it takes the platform's acceleration from.
    #[must_use]
    pub fn input(&self) -> ClosedFormInput {
        self.input
    }

    /// The platform for a pose of all bodies.
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
