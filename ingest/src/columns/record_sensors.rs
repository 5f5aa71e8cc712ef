//! Reads all samples of a log's sensors in one pass.

use super::{
    decoder::Decoder,
    merged_parts,
    pass::Wanted,
    sensor_recording::{SensorRecording, SensorRequest},
    whole_columns::record,
};
use crate::{
    log::Log,
    message::{Error, Losses},
    topics::frames_in,
};

/// Reads all samples of the wanted sensors in one pass over the log.
///
/// `progress` is called from time to time with the number of bytes read so far.
///
/// # Errors
/// A topic does not carry its kind of sensor, or the log cannot be read. Damage is reported in the
/// losses.
pub fn record_sensors(
    log: &Log,
    requests: &[SensorRequest],
    progress: &mut dyn FnMut(u64),
) -> Result<(Vec<SensorRecording>, Losses), Error> {
    let (recordings, losses) = record(log, sensors_of(log, requests)?, None, progress)?;
    let mut recordings = recordings.into_iter();
    let mut merged = Vec::with_capacity(requests.len());
    for request in requests {
        let parts = recordings.by_ref().take(1 + request.other_parts.len());
        merged.extend(merged_parts::join_all(request, parts));
    }
    Ok((merged, losses))
}

/// The sensors to read for all requests: of each request the first part of a sample, then the
/// others.
pub(crate) fn sensors_of(log: &Log, requests: &[SensorRequest]) -> Result<Vec<Wanted>, Error> {
    let mut sensors = Vec::with_capacity(requests.len());
    for request in requests {
        let topic = log.topic(request.topic)?;
        let (kind, joints) = (request.kind, &request.joint_names);
        let decoder = match &request.numbers {
            Some(numbers) => Decoder::numbers(topic, numbers)?,
            None => {
                // threads begin in the middle of the log: all of them take the same sensor
                let frame = match &request.frame_id {
                    None => frames_in(log, request.topic, 1)?.pop(),
                    named => named.clone(),
                };
                Decoder::typed(topic, kind, joints, frame)?
            }
        };
        let width = kind.value_count(joints.len());
        sensors.push(Wanted {
            topic: request.topic,
            decoder,
            width,
        });
        for (topic, numbers) in &request.other_parts {
            sensors.push(Wanted {
                topic: *topic,
                decoder: Decoder::numbers(log.topic(*topic)?, numbers)?,
                width,
            });
        }
    }
    Ok(sensors)
}
