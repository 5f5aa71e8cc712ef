//! From loads to a stability level for the operator, row by row, and a forecast of lift-off.
//!
//! A [`Judge`] has memory: levels have hysteresis, faults are held, and Danger persists until it is
//! acknowledged. The same rows in the same order give the same verdicts, live and offline; the only clock is
//! the time of the rows.
//!
//! ```text
//!     U = 1 - (OTF - 2 sigma) / static load, of the worst wheel        (Uncertainty::utilisation)
//!     notice, warning, limit of [limits] <= U  ->  Notice, Warning, Danger
//!     released where U stays 0.02 below for 1 s
//! ```
//! Safe is earned: where not everything that the loads hang on has been proven ([`Basis`]), the level is Assumed in its stead.
//! The thresholds are this project's choice, modelled on crane load indicators; no standard prescribes any.

mod alarm;
mod basis;
mod input_fault;
mod judge;
mod latch;
mod level;
mod lift_off;
pub mod limits;
#[cfg(test)]
mod rules;

pub use basis::Basis;
pub use input_fault::{InputFault, InputFaults};
pub use judge::{Conditions, HeldProblems, Judge, RowFacts, Verdict};
pub use latch::Latch;
pub use level::Level;
pub use lift_off::{LiftOff, LiftOffForecast};
