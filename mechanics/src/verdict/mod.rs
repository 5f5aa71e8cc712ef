//! What the loads mean for whoever works with the machine: a level, row by row, and the time that is
//! left.
//!
//! A [`Judge`] remembers: levels have hysteresis, faults are held, Danger stays until it is
//! acknowledged. The same rows in the same order give the same verdicts, live and offline; the only
//! time it knows is that of the rows.
//!
//! ```text
//!     U = 1 - (OTF - 2 sigma) / static load, of the worst wheel        (Uncertainty::utilisation)
//!     notice, warning, limit of [limits] <= U  ->  Notice, Warning, Danger
//!     released where U stays 0.02 below for 1 s
//! ```
//! The bands are our choice, modelled on those of crane load indicators; no standard prescribes any.

mod alarm;
mod input_fault;
mod judge;
mod level;
mod lift_off;

pub use input_fault::{InputFault, InputFaults};
pub use judge::{Conditions, Judge, RowFacts, Verdict};
pub use level::Level;
pub use lift_off::{LiftOff, LiftOffForecast};
