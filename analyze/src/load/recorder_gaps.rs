//! What a log's recorder says that it missed.

use anyhow::Result;
use tipwatch_binding::monitor_topic;
use tipwatch_ingest::Log;

/// The gaps in a sentence; none where the log is not of our recorder, or complete.
///
/// # Errors
/// The log cannot be read.
pub(crate) fn note(log: &Log) -> Result<Option<String>> {
    let Some([samples, verdicts]) = monitor_topic::gaps(log)? else {
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
