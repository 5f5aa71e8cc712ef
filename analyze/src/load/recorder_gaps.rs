//! Gaps that the recorder of a log reported.

use anyhow::Result;
use tipwatch_binding::monitor_topic;
use tipwatch_ingest::Log;
use tipwatch_language::{say, word};

/// The gaps as a note; `None` for a complete log or one of another recorder.
///
/// # Errors
/// The log cannot be read.
pub(crate) fn note(log: &Log) -> Result<Option<String>> {
    let Some([samples, verdicts]) = monitor_topic::gaps(log)? else {
        return Ok(None);
    };
    let places = match samples.values.len() {
        0 => return Ok(None),
        1 => word!("1 place").to_owned(),
        places => say!("{places} places"),
    };
    Ok(Some(say!(
        "The recorder of this log missed {} samples and {} verdicts or commands, at {places} (topic {}). The monitor \
         may have received them: its rows there may differ from those computed here.",
        samples.values.iter().sum::<f64>(),
        verdicts.values.iter().sum::<f64>(),
        monitor_topic::GAPS
    )))
}
