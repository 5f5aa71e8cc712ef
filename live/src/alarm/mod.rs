//! The latched alarm on the disk: over the end of a session, a restart of the monitor and a power cut.

mod acknowledgement;
mod exchange;
mod file;
mod store;

pub use acknowledgement::AlarmSeen;
pub use file::{AlarmFile, Kept, default_folder};
pub use store::AlarmStore;
