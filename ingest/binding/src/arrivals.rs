//! The samples of a log in the order of arrival.

use tipwatch_ingest::{SensorRecording, arrival_order};
use tipwatch_mechanics::state::{Sample, Sensor};

/// All samples of the sensors with their log times (ns), in the order of arrival at the recorder,
/// as a live system would have seen them.
pub fn arrivals<'a>(
    signals: Vec<(Sensor, &'a SensorRecording)>,
) -> impl Iterator<Item = (Sample<'a>, i64)> {
    let recordings: Vec<&SensorRecording> =
        signals.iter().map(|(_, recording)| *recording).collect();
    arrival_order(&recordings)
        .into_iter()
        .map(move |(signal, index)| {
            let (sensor, recording) = signals[signal];
            let sample = Sample::new(sensor, recording.stamps_ns[index], recording.sample(index));
            (sample, recording.log_times_ns[index])
        })
}
