//! The contents of a log as a JSON document.

use serde::Serialize;
use tipwatch_ingest::{
    FieldContents, FileTransfer, Losses, StampCorrection, StampSource, TopicTiming,
};

use super::can::BusInspection;
use crate::analysis::clock::ClockOffsets;
use crate::analysis::clock::text::TopicsFinding;

/// Version of the JSON document.
pub(super) const SCHEMA: u32 = 2;
/// Contents of a log.
#[derive(Debug, Serialize)]
pub struct Inspection {
    pub(super) schema: u32,
    pub(super) path: String,
    pub(super) format: String,
    pub(super) files: Vec<String>,
    pub(super) bytes: u64,
    pub(super) topics: Vec<TopicInspection>,
    /// Messages on CAN buses.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) can: Vec<BusInspection>,
    pub(super) signals: Vec<SignalInspection>,
    pub(super) clock: ClockInspection,
    /// Reason why signals cannot be bound.
    pub(super) binding_error: Option<String>,
    /// Topic and length of the robot description.
    pub(super) robot_description: Option<String>,
    /// Requests and bytes that reading took, for each file in a bucket or on a server.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) transfers: Vec<FileTransfer>,
    /// Parts of the log that were lost.
    pub losses: Losses,
    pub(super) integrity: Option<&'static str>,
}

/// The clock to which all signals are converted.
#[derive(Debug, Serialize)]
pub(super) struct ClockInspection {
    /// "header", "publish" or "log".
    pub(super) time: Option<StampSource>,
    /// The topic that defines it; null for the log time.
    pub(super) topic: Option<String>,
    /// Anomalies of the clocks.
    pub(super) findings: Vec<TopicsFinding>,
    /// Offsets between topics, estimated from the physics; null without a machine file.
    pub(super) offsets: Option<ClockOffsets>,
    /// Reason why there are no offsets.
    pub(super) offsets_note: Option<String>,
}

#[derive(Debug, Serialize)]
pub(super) struct TopicInspection {
    pub(super) name: String,
    pub(super) type_name: String,
    pub(super) encoding: String,
    pub(super) definition: String,
    pub(super) message_count: Option<u64>,
    /// Log time (ns) of the first and the last message; null if the log was not read as a whole.
    pub(super) start_ns: Option<i64>,
    pub(super) end_ns: Option<i64>,
    /// Time from the first message to the last (s).
    pub(super) duration_s: Option<f64>,
    /// Messages per second of that time.
    pub(super) rate_hz: Option<f64>,
    /// Every number that the machine file can name as `{ topic, field }`, in the first and the last message.
    pub(super) fields: Vec<FieldContents>,
    /// Reason why fields are not listed, or not all.
    pub(super) fields_note: Option<String>,
    /// Statistics of the stamps, for topics that can be a signal.
    pub(super) timing: Option<TopicTiming>,
    /// Conversion of the stamps to the clock of the log.
    pub(super) correction: Option<StampCorrection>,
    pub(super) joint_names: Vec<String>,
}

#[derive(Debug, Serialize)]
pub(super) struct SignalInspection {
    pub(super) signal: &'static str,
    pub(super) topic: Option<String>,
    pub(super) why: String,
}
