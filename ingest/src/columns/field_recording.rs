//! Single numbers of a log's messages as columns: signals that belong to no sensor.

use super::{
    record_sensors::record,
    sensor_columns::{Collector, Decoder},
};
use crate::{
    clock::{ClockFinding, StampDecision, TimeBase},
    decode::{NumberField, NumberSample, SampleValue},
    log::Log,
    message::{Error, Losses},
    topics::topic_of_field,
};

/// A number of a topic's messages that is wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldRequest {
    /// Name of the topic, of any type.
    pub topic: String,
    /// The number.
    pub number: NumberField,
}

impl FieldRequest {
    /// A number of a topic as the messages have it.
    #[must_use]
    pub fn as_it_is(topic: &str, field: &str) -> Self {
        Self {
            topic: topic.into(),
            number: NumberField {
                field: field.into(),
                joint: None,
                scale: 1.0,
                offset: 0.0,
            },
        }
    }
}

/// A wanted number of all messages, in the order in which the file has them.
#[derive(Debug, Clone)]
pub struct FieldRecording {
    /// Which of the stamps is used, and why.
    pub clock: StampDecision,
    /// What is odd about the clocks.
    pub findings: Vec<ClockFinding>,
    /// When each was measured, by the clock of the log.
    pub stamps_ns: Vec<i64>,
    /// The numbers, scaled and offset; messages without one are left out.
    pub values: Vec<f64>,
    /// Messages that have no such number.
    pub missing: u64,
}

/// Reads numbers of any messages in one pass over the log, and puts them on the clock of its sensors, or
/// without one on the clock that they have in common.
///
/// # Errors
/// A topic is not in the log, its messages have no such field or none of them has the number, or the log
/// cannot be read. Damage is told by the losses.
pub fn record_fields(
    log: &Log,
    requests: &[FieldRequest],
    time_base: Option<&TimeBase>,
) -> Result<(Vec<FieldRecording>, Losses), Error> {
    let mut collectors = Vec::with_capacity(requests.len());
    for request in requests {
        let topic = topic_of_field(log, &request.topic, &request.number.field)?;
        let sample = NumberSample {
            values: vec![SampleValue::Field(request.number.clone())],
            has_roll_pitch_yaw: false,
        };
        let decoder = Decoder::numbers(topic, &sample)?;
        collectors.push(Collector::new(topic.id, decoder, 1));
    }
    let (recordings, losses) = record(log, collectors, time_base, &mut |_| {})?;
    let field = |recording: crate::SensorRecording| FieldRecording {
        clock: recording.clock,
        findings: recording.findings,
        stamps_ns: recording.stamps_ns,
        values: recording.values,
        missing: recording.without_value,
    };
    Ok((recordings.into_iter().map(field).collect(), losses))
}
