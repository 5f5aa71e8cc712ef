//! The time that a recording covers, by the times of the log.
//!
//! A description that was published an hour before the first sensor, and what a clip carries from before its span, do
//! not make the recording longer. Sensors that stop while others go on do.

use std::ops::ControlFlow;

use anyhow::Result;
use tipwatch_ingest::{Log, Topic, TopicId, metadata_records};

use crate::base::clip;

/// A topic with fewer messages is no stream: its messages come once, or at single occasions.
const LEAST_STREAM: u64 = 10;

/// First and last log time of a recording (ns); `None` where only the used topics determine it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordingSpan {
    /// The first.
    pub first_ns: Option<i64>,
    /// The last.
    pub last_ns: Option<i64>,
}

/// The span of a log of which some topics are used.
///
/// # Errors
/// The log cannot be read.
pub(super) fn of(log: &Log, used: &[TopicId]) -> Result<RecordingSpan> {
    let Some((first_ns, last_ns)) = log.span_ns() else {
        return Ok(RecordingSpan {
            first_ns: None,
            last_ns: None,
        });
    };
    let records = metadata_records(log)?;
    if let Some(origin) = clip::origin(&records) {
        let time = |key: &str| origin.get(key).and_then(|time| time.parse::<i64>().ok());
        // what was carried over is from before the span; where the log began within it, the used topics tell
        let start_ns = time(clip::START_KEY).unwrap_or(first_ns);
        let end_ns = time(clip::END_KEY).unwrap_or(last_ns);
        return Ok(RecordingSpan {
            first_ns: Some(first_ns).filter(|first| *first >= start_ns),
            last_ns: Some(last_ns.min(end_ns)),
        });
    }
    let is_rare = |topic: &&Topic| {
        let few = topic
            .message_count
            .is_some_and(|count| count < LEAST_STREAM);
        !used.contains(&topic.id) && (few || topic.is_latched())
    };
    let rare: Vec<TopicId> = (log.topics().iter())
        .filter(is_rare)
        .map(|topic| topic.id)
        .collect();
    let mut ends: Option<(i64, i64)> = None;
    if !rare.is_empty() {
        log.read(&rare, &mut |message| {
            let time = message.log_time_ns;
            let (first, last) = ends.unwrap_or((time, time));
            ends = Some((first.min(time), last.max(time)));
            ControlFlow::Continue(())
        })?;
    }
    Ok(RecordingSpan {
        first_ns: Some(first_ns).filter(|first| ends.is_none_or(|(rare, _)| rare > *first)),
        last_ns: Some(last_ns).filter(|last| ends.is_none_or(|(_, rare)| rare < *last)),
    })
}
