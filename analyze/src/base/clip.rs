//! Clips: spans that were cut out of a log around its events.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_ingest::MetadataRecord;

use super::file_hash::FileHash;

/// Name of the metadata record with the origin of a clip.
pub(crate) const ORIGIN: &str = "tipwatch_clip_of";

/// Its keys for the first and the last log time of the span (ns).
pub(crate) const START_KEY: &str = "start_log_time_ns";
pub(crate) const END_KEY: &str = "end_log_time_ns";

/// A clip of the log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Clip {
    /// The file, its path relative to the output folder.
    #[serde(flatten)]
    pub file: FileHash,
    /// First time of the span, by the log's own times (ns).
    pub start_log_ns: i64,
    /// Last time of the span, by the log's own times (ns).
    pub end_log_ns: i64,
    /// The events around which it was cut.
    pub events: Vec<ClipEvent>,
    /// Messages within the span.
    pub messages: u64,
    /// Messages from before the span: the last one of each latched and each slow topic.
    pub carried: u64,
    /// Messages of latched topics that were too large or too many to be carried over.
    pub left_out: u64,
}

/// An event of a clip.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ClipEvent {
    /// Its kind.
    pub kind: &'static str,
    /// The wheel, edge or signal.
    pub subject: String,
    /// Its start (ns), on the clock of the analysis.
    pub start_ns: i64,
}

/// Returns the origin of a clip as the log records it; `None` if the log is no clip.
pub(crate) fn origin(records: &[MetadataRecord]) -> Option<BTreeMap<String, String>> {
    let mut clips = records.iter().filter(|record| record.name == ORIGIN);
    // a clip of a clip has both; the last is its own
    clips.next_back().map(|record| record.values.clone())
}
