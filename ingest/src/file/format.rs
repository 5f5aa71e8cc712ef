//! The formats of log files.

use serde::Serialize;
use strum::Display;

/// The format of log files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Display)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Format {
    /// MCAP, with or without chunks, compression and summary.
    #[strum(serialize = "MCAP")]
    Mcap,
    /// The bag of ROS 1, version 2.0.
    #[strum(serialize = "ROS 1 bag")]
    Ros1Bag,
    /// The SQLite database of rosbag2.
    #[strum(serialize = "rosbag2 SQLite")]
    Rosbag2Sqlite,
}

impl Format {
    /// Whether messages have a publish time in addition to the log time.
    pub fn has_publish_time(self) -> bool {
        match self {
            Format::Mcap => true,
            Format::Ros1Bag | Format::Rosbag2Sqlite => false,
        }
    }
}
