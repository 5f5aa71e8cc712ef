//! Reads a log as the machine file binds it: the checked machine, the samples of its sensors, cylinder forces.

mod arrivals;
mod column;
pub(crate) mod linkage_force;
mod loaded;
pub(crate) mod recorder_gaps;
mod recording;
mod sample_store;
mod smoothing;
pub(crate) mod supports;

pub use loaded::{LoadedLog, Signal, load, load_within};
pub use recording::{Recording, SampleReader};
pub use smoothing::{SharedSignal, block_smoother};
