//! The controller: from the state of the machine to valve commands.

mod command;
mod controller;
mod optimiser;
mod rod_watch;

pub use command::{Command, Status};
pub use controller::{Controller, RodForce};
pub use optimiser::SuspensionOptimiser;
pub use rod_watch::{MOVING_OPENING, RodFault, RodWatch, STILL_ROD_M, STILL_ROD_S, TRIAL_OPENING};
