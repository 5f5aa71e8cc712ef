//! The controller: from the state of the machine to valve commands.

mod command;
mod controller;
mod optimiser;

pub use command::{Command, Status};
pub use controller::Controller;
pub use optimiser::SuspensionOptimiser;
