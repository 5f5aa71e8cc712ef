//! The formats of log files.

use std::fmt;

use serde::Serialize;

/// The format of a log's files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Format {
    /// MCAP, with or without chunks, compression and summary.
    Mcap,
    /// The bag of ROS 1, version 2.0.
    Ros1Bag,
    /// The SQLite database of rosbag2.
    Rosbag2Sqlite,
}

impl Format {
    /// Whether messages have a publish time beside the log time.
    pub fn has_publish_time(self) -> bool {
        match self {
            Format::Mcap => true,
            Format::Ros1Bag | Format::Rosbag2Sqlite => false,
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Format::Mcap => "MCAP",
            Format::Ros1Bag => "ROS 1 bag",
            Format::Rosbag2Sqlite => "rosbag2 SQLite",
        })
    }
}
