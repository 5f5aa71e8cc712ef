//! Verdict and inputs as `diagnostic_msgs/DiagnosticArray` for diagnostics panels.

use anyhow::Result;
use tipwatch_ingest::{Ros2Writer, WriterTopic};
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::Machine;

use super::messages::{DiagnosticArray, DiagnosticStatus, Header, KeyValue, Time};
use crate::base::number::in_english;
use crate::base::rows::Rows;
use crate::events::Event;

/// Levels of a `DiagnosticStatus`.
const OK: u8 = 0;
const WARN: u8 = 1;
const ERROR: u8 = 2;
const STALE: u8 = 3;

/// The topic of the diagnostics.
#[derive(Debug)]
pub(super) struct Diagnostics {
    topic: WriterTopic,
    /// The events of the inputs.
    events: Vec<Event>,
}

impl Diagnostics {
    pub(super) fn begin(input_events: &[Event], writer: &mut Ros2Writer) -> Result<Self> {
        let topic = writer.topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", None)?;
        Ok(Self {
            topic,
            events: input_events.to_vec(),
        })
    }

    /// Writes the stability and the input quality of a row.
    pub(super) fn write(
        &self,
        machine: &Machine,
        rows: &Rows,
        row: usize,
        writer: &mut Ros2Writer,
    ) -> Result<()> {
        let time_ns = rows.times_ns[row];
        let message = DiagnosticArray {
            header: Header {
                stamp: Time::from_ns(time_ns),
                frame_id: machine.base_link(),
            },
            status: vec![
                stability(machine, rows, row),
                self.inputs(machine, rows, row),
            ],
        };
        Ok(writer.write(self.topic, time_ns, &message)?)
    }

    /// Status of the inputs of a row, with its gaps and faults.
    fn inputs<'a>(&self, machine: &'a Machine, rows: &Rows, row: usize) -> DiagnosticStatus<'a> {
        let (time_ns, reasons) = (rows.times_ns[row], rows.reasons[row]);
        let events = self.events.iter().filter(|event| {
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
        let (level, message) = match (reasons.leave_valid(), values.is_empty()) {
            (true, true) => (OK, "all inputs valid".to_string()),
            (true, _) if reasons.have_doubt() => (
                WARN,
                "row valid, but signals contradict each other".to_string(),
            ),
            (true, false) => (
                WARN,
                "row valid despite an implausible or missing input".to_string(),
            ),
            (false, _) => {
                let names: Vec<_> = reasons.iter().map(|r| r.name().replace('_', " ")).collect();
                (ERROR, format!("row not valid: {}", names.join(", ")))
            }
        };
        status(machine, "tipwatch: inputs", level, message, values)
    }
}

fn status<'a>(
    machine: &'a Machine,
    name: &'static str,
    level: u8,
    message: String,
    values: Vec<KeyValue>,
) -> DiagnosticStatus<'a> {
    DiagnosticStatus {
        level,
        name,
        message,
        hardware_id: machine.name(),
        values,
    }
}

fn stability<'a>(machine: &'a Machine, rows: &Rows, row: usize) -> DiagnosticStatus<'a> {
    let (level, message) = match &rows.verdicts {
        Some(verdicts) => {
            let level = verdicts.verdicts[row].level;
            (level.diagnostic(), level.name().to_string())
        }
        None => (STALE, "no verdict with this model".to_string()),
    };
    let mut values = Vec::new();
    let mut add = |key: String, value: f64, unit: &str| {
        let value = match value.is_finite() {
            true => format!("{} {unit}", in_english(value)),
            false => "unknown".to_string(),
        };
        values.push(KeyValue { key, value });
    };
    for (wheel, facts) in machine.wheels().iter().enumerate() {
        let load = rows.outcomes.column(Quantity::Load(wheel))[row];
        add(format!("load {}", facts.name), load, "N");
    }
    if let Some(utilisation) = rows.outcomes.known_column(Quantity::Utilisation) {
        add("utilisation".to_string(), utilisation[row], "");
    }
    if let Some(verdicts) = &rows.verdicts {
        let seconds = verdicts.time_to_lift_off_s[row];
        add("time to lift-off".to_string(), seconds, "s");
    }
    status(machine, "tipwatch: stability", level, message, values)
}
