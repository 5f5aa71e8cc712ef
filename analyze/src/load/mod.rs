//! Reads a log as the machine file binds it: the checked machine, the samples of its sensors, cylinder forces.

pub(crate) mod linkage_force;
mod loaded;
pub(crate) mod recorder_gaps;

pub use loaded::{LoadedLog, Signal, load};
