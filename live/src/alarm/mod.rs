//! The latched alarm on the disk, and what is doubted: over the end of a session, a restart of the monitor and a power cut.

mod acknowledgement;
mod doubted;
mod exchange;
mod file;
mod identity_lock;
mod last_positions;
mod store;

pub use acknowledgement::{Acknowledged, AlarmSeen};
pub use doubted::{DoubtedSignal, DoubtedSignals, SignalName};
pub use file::{AlarmFile, Kept, default_folder};
pub use last_positions::{LastPosition, LastPositions};
pub use store::AlarmStore;
