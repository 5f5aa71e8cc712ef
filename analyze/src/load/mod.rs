//! Reads a log as the machine file binds it: the checked machine, the samples of its sensors, cylinder forces, measured loads.

mod arrivals;
mod column;
mod held_forces;
pub(crate) mod linkage_force;
mod loaded;
mod log_times;
pub(crate) mod recorder_gaps;
mod recording;
mod sample_store;
mod smoothing;
mod span;
mod standing;
pub(crate) mod supports;
mod wheel_load;

pub use loaded::{LoadedLog, Signal, load, load_within};
pub use log_times::LogTimes;
pub use recording::{Recording, SampleReader};
pub use smoothing::{SharedSignal, block_smoother, shared_signals};
pub use span::RecordingSpan;
pub(crate) use standing::Standing;
pub use wheel_load::{MeasuredLoad, MeasuredLoads};
