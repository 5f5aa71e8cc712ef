//! The active suspension: where the rods of a suspension should move so that the wheels stay on the
//! ground, the second paper's (30)-(31).
//!
//! ```text
//!     state -> carriers -> condensed -> instant          once a step: what the suspension leaves as it is
//!     rods -> prospect (loads, angles) -> evaluation     for each motion of the rods that is looked at
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
mod problem;
mod prospect;
mod quadratic_step;
mod raise;
mod replay;
mod response;
mod stabiliser;
mod support;
mod suspended_machine;
mod weights;

#[cfg(test)]
mod against_whole_body;

pub use command::{Command, Status};
pub use controller::Controller;
pub use critical_step::CriticalStep;
pub use error::StabiliserError;
pub use replay::Replay;
pub use stabiliser::Stabiliser;
pub use suspended_machine::MAX_ACTUATORS;
