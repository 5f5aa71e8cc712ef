//! A log as a whole: which files belong to it, and the reading of all of them in order.

mod can_topics;
mod log_files;
mod open_log;
mod packed_messages;
mod rosbag2_folder;
mod rosbag2_metadata;

pub(crate) use self::can_topics::CanPass;
pub use self::{can_topics::CanTopic, open_log::Log};
