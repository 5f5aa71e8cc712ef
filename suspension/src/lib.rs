//! Control of an active suspension: moves its cylinders so that all wheels stay on the ground, (30)-(31) of the
//! second paper.
//!
//! ```text
//!     state -> carriers -> condensed -> instant          once per step: independent of the suspension
//!     rods -> prospect (loads, angles) -> evaluation     for each candidate motion of the rods
//!     limits, weights -> problem -> minimise -> command
//! ```

#![forbid(unsafe_code)]
mod carriers;
mod command;
mod condensed;
mod controller;
mod critical_step;
mod error;
mod evaluation;
pub mod hydraulics;
mod instant;
mod limits;
mod minimise;
mod optimiser;
mod predicted_state;
mod problem;
mod quadratic_step;
mod raise;
mod replay;
mod response;
mod support;
mod suspended_machine;
mod weights;

#[cfg(test)]
mod against_whole_body;

pub use command::{Command, Status};
pub use controller::Controller;
pub use critical_step::CriticalStep;
pub use error::SuspensionError;
pub use optimiser::SuspensionOptimiser;
pub use replay::Replay;
pub use suspended_machine::MAX_ACTUATORS;
