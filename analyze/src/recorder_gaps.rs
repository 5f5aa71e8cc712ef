//! What a log's recorder says that it missed.

use anyhow::Result;
use tipwatch_binding::monitor_topic;
use tipwatch_ingest::{FieldRequest, Log, record_fields};

/// The gaps in a sentence; none where the log is not of our recorder, or complete.
///
/// # Errors
/// The log cannot be read.
pub(crate) fn note(log: &Log) -> Result<Option<String>> {
    let is_there = log.topics().iter().any(|topic| {
        topic.name == monitor_topic::GAPS && topic.type_name == monitor_topic::GAPS_TYPE_NAME
    });
    if !is_there {
        return Ok(None);
    }
    let requests =
        monitor_topic::GAPS_FIELDS.map(|field| FieldRequest::as_it_is(monitor_topic::GAPS, field));
    let (columns, _) = record_fields(log, &requests, None)?;
    let [samples, verdicts] = &columns[..] else {
        return Ok(None);
    };
    let places = match samples.values.len() {
        0 => return Ok(None),
        1 => "1 place".to_owned(),
        places => format!("{places} places"),
    };
    Ok(Some(format!(
        "The recorder of this log did not get, or could not read, {} samples and {} verdicts or commands, at {places} (topic {}). The \
         monitor may have had them: its rows there need not be those that are computed here.",
        samples.values.iter().sum::<f64>(),
        verdicts.values.iter().sum::<f64>(),
        monitor_topic::GAPS
    )))
}
