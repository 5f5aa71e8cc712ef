//! Which model of the ground wrench the loads come from.

use crate::closed_form::{ClosedFormError, ClosedFormInput, PlacedPlatform, PlatformParts};
use crate::machine::Machine;

/// A model of the ground wrench. What follows from the wrench (loads, contact, envelope) is the same code
/// for all.
#[derive(Debug, Clone)]
pub enum Model {
    /// Newton-Euler over every body.
    WholeBody,
    /// The first paper's analytic model.
    ClosedForm(Box<ClosedForm>),
}

/// The analytic model for one machine: its platform frozen in one posture.
#[derive(Debug, Clone)]
pub struct ClosedForm {
    pub(crate) parts: PlatformParts,
    pub(crate) placed: PlacedPlatform<f64>,
    pub(crate) input: ClosedFormInput,
}

impl ClosedForm {
    /// The model of `machine` with the platform of the posture with its joints at these positions (rad or
    /// m), in the order of [`Machine::joints`].
    ///
    /// # Errors
    /// [`ClosedFormError`]: the machine is not of the kind that the analytic model describes.
    pub fn new(
        machine: &Machine,
        joint_positions: &[f64],
        input: ClosedFormInput,
    ) -> Result<Self, ClosedFormError> {
        let parts = PlatformParts::of(machine)?;
        let placed = parts.place(machine, joint_positions)?;
        Ok(Self {
            parts,
            placed,
            input,
        })
    }

    /// Which signals it takes the platform's acceleration from.
    #[must_use]
    pub fn input(&self) -> ClosedFormInput {
        self.input
    }
}
