//! Record of a monitor in a log, as far as the verdicts of the log's rows depend on it.

use std::collections::BTreeMap;

use anyhow::Result;
use tipwatch_binding::monitor_topic;
use tipwatch_ingest::Log;
use tipwatch_mechanics::estimation::plausibility::SignalDoubt;
use tipwatch_mechanics::verdict::{Conditions, InputFaults, Latch, Level};

use crate::base::verdicts::MonitorRecord;

/// Reads the record. `inherited`: the doubts of signals with which its session began, where they are not followed sample by sample.
///
/// # Errors
/// The log cannot be read.
pub(crate) fn monitor_record(log: &Log, inherited: &[SignalDoubt]) -> Result<MonitorRecord> {
    Ok(MonitorRecord {
        conditions: recorded(log)?,
        inherited: inherited_alarm(log)?,
        is_contradicted: inherited_contradiction(log)?,
        doubted_rows: monitor_topic::doubted_rows(log, inherited)?,
    })
}

type Recorded = BTreeMap<i64, (Conditions, bool)>;

/// Input faults that a monitor recorded in the log, by time of the row.
fn recorded(log: &Log) -> Result<Recorded> {
    let Some(columns) = monitor_topic::verdicts(log)? else {
        return Ok(Recorded::new());
    };
    let [event, faults, cautions, acknowledged] = &columns;
    let set = |number: f64| InputFaults::from_bits(number as u32);
    let rows = (0..event.values.len())
        .filter(|&at| event.values[at] == f64::from(monitor_topic::EVENT_ROW))
        .map(|at| {
            let conditions = Conditions {
                faults: set(faults.values[at]),
                cautions: set(cautions.values[at]),
            };
            (
                event.stamps_ns[at],
                (conditions, acknowledged.values[at] != 0.0),
            )
        });
    Ok(rows.collect())
}

/// The latched alarm with which the recorded session began. A monitor that was restarted meanwhile resumed its own alarm:
/// only the first verdict tells what was there before.
fn inherited_alarm(log: &Log) -> Result<Latch> {
    let Some([level, is_acknowledged]) = monitor_topic::inherited_alarms(log)? else {
        return Ok(Latch::default());
    };
    let level = level.values.first().filter(|level| **level != 0.0);
    Ok(Latch {
        level: level.map(|level| Level::from_number(*level as u32)),
        is_acknowledged: is_acknowledged.values.first().is_some_and(|n| *n != 0.0),
    })
}

/// Whether the sensors were contradicted in a session before.
fn inherited_contradiction(log: &Log) -> Result<bool> {
    let known = monitor_topic::inherited_contradictions(log)?;
    let first = known.and_then(|[found]| found.values.first().copied());
    Ok(first.is_some_and(|number| number != 0.0))
}
