//! Verdict and inputs as `diagnostic_msgs/DiagnosticArray` for diagnostics panels.

use anyhow::Result;
use tipwatch_ingest::{Ros2Writer, WriterTopic};
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::verdict::Level;

use super::messages::{DiagnosticArray, DiagnosticStatus, Header, KeyValue, Time};
use crate::analysis::Analysis;
use crate::base::number::number;
use crate::base::rows::Rows;

/// Levels of a `DiagnosticStatus`.
const OK: u8 = 0;
const WARN: u8 = 1;
const ERROR: u8 = 2;
const STALE: u8 = 3;

/// The topic of the diagnostics.
#[derive(Debug)]
pub(super) struct Diagnostics<'a> {
    analysis: &'a Analysis,
    topic: WriterTopic,
}

impl<'a> Diagnostics<'a> {
    pub(super) fn begin(analysis: &'a Analysis, writer: &mut Ros2Writer) -> Result<Self> {
        let topic = writer.topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", None)?;
        Ok(Self { analysis, topic })
    }

    /// Writes the stability and the input quality of a row.
    pub(super) fn write(&self, rows: &Rows, row: usize, writer: &mut Ros2Writer) -> Result<()> {
        let time_ns = rows.times_ns[row];
        let message = DiagnosticArray {
            header: Header {
                stamp: Time::from_ns(time_ns),
                frame_id: self.analysis.machine.base_link(),
            },
            status: vec![self.stability(rows, row), self.inputs(rows, row)],
        };
        Ok(writer.write(self.topic, time_ns, &message)?)
    }

    fn status(
        &self,
        name: &'static str,
        level: u8,
        message: String,
        values: Vec<KeyValue>,
    ) -> DiagnosticStatus<'_> {
        DiagnosticStatus {
            level,
            name,
            message,
            hardware_id: self.analysis.machine.name(),
            values,
        }
    }

    fn stability(&self, rows: &Rows, row: usize) -> DiagnosticStatus<'_> {
        let (level, message) = match &rows.verdicts {
            Some(verdicts) => {
                let level = verdicts.verdicts[row].level;
                (diagnostic_level(level), level.name().to_string())
            }
            None => (STALE, "no verdict with this model".to_string()),
        };
        let mut values = Vec::new();
        let mut add = |key: String, value: f64, unit: &str| {
            let value = match value.is_finite() {
                true => format!("{} {unit}", number(value)),
                false => "unknown".to_string(),
            };
            values.push(KeyValue { key, value });
        };
        for (wheel, facts) in self.analysis.machine.wheels().iter().enumerate() {
            let load = rows.outcomes.column(Quantity::Load(wheel))[row];
            add(format!("load {}", facts.name), load, "N");
        }
        if rows.outcomes.quantities.contains(&Quantity::Utilisation) {
            let utilisation = rows.outcomes.column(Quantity::Utilisation)[row];
            add("utilisation".to_string(), utilisation, "");
        }
        if let Some(verdicts) = &rows.verdicts {
            let seconds = verdicts.time_to_lift_off_s[row];
            add("time to lift-off".to_string(), seconds, "s");
        }
        self.status("tipwatch: stability", level, message, values)
    }

    /// Status of the inputs of a row, with its gaps and faults.
    fn inputs(&self, rows: &Rows, row: usize) -> DiagnosticStatus<'_> {
        let (time_ns, reasons) = (rows.times_ns[row], rows.reasons[row]);
        let events = self.analysis.events.iter().filter(|event| {
            !event.kind.is_stability()
                && event.start_ns <= time_ns
                && event.end_ns.is_none_or(|end_ns| time_ns < end_ns)
        });
        let values: Vec<KeyValue> = events
            .map(|event| KeyValue {
                key: event.subject.clone(),
                value: match &event.fault {
                    Some(fault) => fault.kind.name().replace('_', " "),
                    None => "missing".to_string(),
                },
            })
            .collect();
        let (level, message) = match (reasons.is_empty(), values.is_empty()) {
            (true, true) => (OK, "all inputs valid".to_string()),
            (true, false) => (
                WARN,
                "row valid despite an implausible or missing input".to_string(),
            ),
            (false, _) => {
                let names: Vec<_> = reasons.iter().map(|r| r.name().replace('_', " ")).collect();
                (ERROR, format!("row not valid: {}", names.join(", ")))
            }
        };
        self.status("tipwatch: inputs", level, message, values)
    }
}

fn diagnostic_level(level: Level) -> u8 {
    match level {
        Level::Safe => OK,
        Level::Notice | Level::Warning => WARN,
        Level::Danger | Level::Fault => ERROR,
        Level::Unknown => STALE,
    }
}
