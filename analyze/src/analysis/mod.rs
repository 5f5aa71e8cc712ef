//! The analysis of one log: [`run`] estimates its states, evaluates wheel loads, and studies what they
//! depend on.

pub mod clock;
mod evaluation;
pub mod imu_check;
pub mod inputs;
pub mod model_comparison;
pub mod monte_carlo;
mod notes;
pub mod payload;
mod result;
pub mod run;
pub mod sensitivity;
mod verdicts;

pub use result::{Analysis, Input, Sources};
