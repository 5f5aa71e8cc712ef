//! Active suspension: optimal control of its cylinders, (30)-(31) of the second paper, their hydraulics, and replay of
//! recorded states with another motion of the suspension.
//!
//! ```text
//!     state -> carriers -> instant                             once per step: independent of the suspension
//!     rods -> predicted state (loads, angles) -> evaluation    for each candidate motion of the rods
//!     limits, weights -> problem -> minimise -> command
//!     command -> reference -> valve -> cylinder                once per row
//! ```

#![forbid(unsafe_code)]
mod condensed;
mod control;
mod cost;
mod error;
mod guard;
pub mod hydraulics;
mod prediction;
mod problem;
pub mod protocol;
pub mod replay;
mod solve;

pub use condensed::MAX_ACTUATORS;
pub use control::{
    Command, Controller, MOVING_OPENING, RodFault, RodForce, RodWatch, STILL_ROD_M, STILL_ROD_S,
    Status, SuspensionOptimiser, TRIAL_OPENING,
};
pub use error::SuspensionError;
pub use problem::CriticalStep;
pub use replay::Replay;
