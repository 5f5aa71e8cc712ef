//! The machine at one instant as a few rigid carriers, independent of the motion of its suspension.

mod carriers;
mod condensed_machine;
mod instant;
mod suspended_machine;

pub(crate) use carriers::ActuatorCoordinates;
#[cfg(test)]
pub(crate) use carriers::Carriers;
pub(crate) use condensed_machine::Whole;
pub(crate) use instant::Instant;
pub use suspended_machine::MAX_ACTUATORS;
pub(crate) use suspended_machine::{STROKE_POSITIONS, SuspendedMachine};
