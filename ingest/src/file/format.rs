//! The formats of log files.

use serde::Serialize;
use strum::Display;
use tipwatch_can::ContainerFormat;

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
    /// CAN frames as text of candump.
    #[strum(serialize = "candump")]
    Candump,
    /// CAN frames of Vector tools, as text.
    #[strum(serialize = "Vector ASC")]
    Asc,
    /// CAN frames of Vector tools.
    #[strum(serialize = "Vector BLF")]
    Blf,
    /// CAN frames of PEAK PCAN tools, as text.
    #[strum(serialize = "PEAK TRC")]
    Trc,
    /// CAN frames in ASAM MDF, version 4.
    #[strum(serialize = "ASAM MF4")]
    Mf4,
    /// A table in text, with a column of time.
    #[strum(serialize = "CSV table")]
    Csv,
    /// A table in Parquet, with a column of time.
    #[strum(serialize = "Parquet table")]
    Parquet,
}

impl From<ContainerFormat> for Format {
    fn from(format: ContainerFormat) -> Self {
        match format {
            ContainerFormat::Candump => Self::Candump,
            ContainerFormat::Asc => Self::Asc,
            ContainerFormat::Blf => Self::Blf,
            ContainerFormat::Trc => Self::Trc,
            ContainerFormat::Mf4 => Self::Mf4,
        }
    }
}

impl Format {
    /// Whether messages have a publish time in addition to the log time.
    pub fn has_publish_time(self) -> bool {
        self == Self::Mcap
    }
}
