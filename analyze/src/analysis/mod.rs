//! The analysis of one log. [`run`] takes six `steps`: read, estimate states, prepare the machine, check sensors, evaluate,
//! study.

mod accelerometer_bias;
pub mod advice;
pub(crate) mod calendar;
pub mod clock;
pub mod coverage;
pub mod digest;
mod estimate;
pub(crate) mod evaluation;
mod gather;
mod ground;
pub mod health;
mod imu_check;
pub mod inputs;
pub mod margin;
pub mod measured_loads;
mod measured_log;
pub mod measured_torques;
pub mod model_comparison;
pub mod monte_carlo;
mod notes;
mod of_events;
pub mod payload;
mod posture_range;
mod prediction;
mod provenance;
pub mod quasi_static;
mod redundancy;
mod result;
mod rotations;
pub mod run;
pub mod sensitivity;
mod size;
pub(crate) mod standing_rows;
mod state_blocks;
mod steps;
mod studies;
mod study;
#[cfg(test)]
mod study_example;
mod supports;
mod task;
mod tested_signs;
pub mod undecided;
pub mod unstated_load;
mod verdicts;

pub use coverage::Coverage;
pub use digest::Digest;
pub(crate) use estimate::posture_in_log;
pub use estimate::{clock_offsets, states};
pub(crate) use measured_log::MeasuredLog;
pub use quasi_static::Exclusion;
pub use result::{Analysis, Input, Sources};
pub use undecided::{DEFAULT_MIN_VALID, Undecided};
