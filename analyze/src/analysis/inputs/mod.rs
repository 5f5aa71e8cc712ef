//! Gross inputs: data of a log that contradict physics or the machine so plainly that nothing can be concluded,
//! such as a signal in another unit. Found before any event.
//!
//! Faults of the machine description alone are refused when the machine is checked, offline and live.

mod actuators;
mod attitude;
mod fields;
mod find;
mod gross_input;
mod gyro;
mod joints;
mod odometry;
mod proportion;
mod slots;
mod specific_force;
mod stance;
mod windows;

pub(crate) use attitude::{notes_on_slope, untested_mounting};
pub(crate) use find::gross_inputs;
pub use gross_input::{GrossInput, GrossInputKind};
pub(crate) use stance::{is_quiet, looked_at};
