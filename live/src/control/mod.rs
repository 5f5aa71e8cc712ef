//! The control of an active suspension: samples and verdicts in, valve commands out.
//!
//! [`Control`] knows no shared memory; [`ControlProgram`] joins the two.

mod program;
mod session_control;
mod valve_command;

pub use program::ControlProgram;
pub use session_control::{Control, Publish};
