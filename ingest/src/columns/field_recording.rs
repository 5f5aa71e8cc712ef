//! Reads single numbers of a log's messages as columns, for signals outside the sensors.

use super::{
    decoder::Decoder, pass::Wanted, sensor_recording::SensorRecording, whole_columns::record,
};
use crate::{
    clock::TimeBase,
    decode::{NumberField, SampleSpec, ValueSource},
    log::Log,
    message::{Error, Losses},
    topics::topic_of_field,
};

/// A request for a number in the messages of a topic.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldRequest {
    /// Name of the topic, of any type.
    pub topic: String,
    /// The number.
    pub number: NumberField,
}

impl FieldRequest {
    /// Requests a number without scale and offset.
    #[must_use]
    pub fn raw(topic: &str, field: &str) -> Self {
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

/// Reads numbers from any messages in one pass over the log, on the given clock, or else on the
/// clock that they have in common. Each is a sample of one value, scaled and offset.
///
/// # Errors
/// A topic is not in the log, its messages have no such field, none of them has the number, or the
/// log cannot be read. Damage is reported in the losses.
pub fn record_fields(
    log: &Log,
    requests: &[FieldRequest],
    time_base: Option<&TimeBase>,
) -> Result<(Vec<SensorRecording>, Losses), Error> {
    let mut sensors = Vec::with_capacity(requests.len());
    for request in requests {
        let topic = topic_of_field(log, &request.topic, &request.number.field)?;
        let sample = SampleSpec::of(vec![ValueSource::Field(request.number.clone())]);
        sensors.push(Wanted {
            topic: topic.id,
            decoder: Decoder::numbers(topic, &sample)?,
            width: 1,
        });
    }
    record(log, sensors, time_base, &mut |_| {})
}
