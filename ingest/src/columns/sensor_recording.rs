//! The samples of one sensor as columns, and the request for them.

use super::sensor_reading::SensorReading;
use crate::{
    decode::SampleSpec,
    message::{SensorKind, TopicId},
};

/// A request for the samples of one sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorRequest {
    /// Its topic.
    pub topic: TopicId,
    /// The kind of sensor.
    pub kind: SensorKind,
    /// Wanted joints in order, for joint states.
    pub joint_names: Vec<String>,
    /// The numbers that make up a sample, if the messages are not of the standard type.
    pub numbers: Option<SampleSpec>,
    /// Parts of a sample that come on separate topics: the values absent in `numbers`.
    pub other_parts: Vec<(TopicId, SampleSpec)>,
    /// `header.frame_id` of the sensor, if its messages are of a standard type; messages with another one are left out.
    /// `None` for that of the first message.
    pub frame_id: Option<String>,
}

impl SensorRequest {
    /// Requests the samples in messages of a standard type, of the sensor of the first one.
    #[must_use]
    pub fn typed(topic: TopicId, kind: SensorKind, joint_names: Vec<String>) -> Self {
        Self {
            topic,
            kind,
            joint_names,
            numbers: None,
            other_parts: Vec::new(),
            frame_id: None,
        }
    }

    /// Requests samples that are made up of numbers of any messages.
    #[must_use]
    pub fn numbered(topic: TopicId, kind: SensorKind, sample: SampleSpec) -> Self {
        Self {
            numbers: Some(sample),
            ..Self::typed(topic, kind, Vec::new())
        }
    }
}

/// All samples of one sensor, in file order.
#[derive(Debug, Clone)]
pub struct SensorRecording {
    /// Other results of reading the log; the samples are already placed on its clock, and those without a usable stamp omitted.
    pub reading: SensorReading,
    /// Time of measurement of each sample, on the clock of the log.
    pub stamps_ns: Vec<i64>,
    /// Time at which the recorder received each sample (ns).
    pub log_times_ns: Vec<i64>,
    /// The values, sample after sample: see [`SensorSample`](crate::SensorSample).
    pub values: Vec<f64>,
    /// The number of values per sample.
    pub width: usize,
    /// Position of each sample among the messages read, in file order.
    pub(crate) order: Vec<u32>,
}

/// The order of arrival of all samples: pairs (recording, sample), sorted by log time, then by file
/// order. Among samples of one message, the first recording comes last: rows are computed at its
/// samples and must include the others.
pub fn arrival_order(recordings: &[&SensorRecording]) -> Vec<(usize, usize)> {
    let indices = |(recording, of): (usize, &&SensorRecording)| {
        (0..of.stamps_ns.len()).map(move |i| (recording, i))
    };
    let mut order: Vec<(usize, usize)> = recordings.iter().enumerate().flat_map(indices).collect();
    order.sort_by_key(|&(place, sample)| {
        let recording = &recordings[place];
        let within_message = std::cmp::Reverse(place);
        (
            recording.log_times_ns[sample],
            recording.order[sample],
            within_message,
        )
    });
    order
}

impl SensorRecording {
    /// The values of one sample.
    pub fn sample(&self, index: usize) -> &[f64] {
        &self.values[index * self.width..(index + 1) * self.width]
    }

    /// Shifts every stamp by `seconds`: a clock offset from the machine file, or an estimated one.
    pub fn shift(&mut self, seconds: f64) {
        let shift_ns = (seconds * 1e9).round() as i64;
        for stamp in &mut self.stamps_ns {
            *stamp = stamp.saturating_add(shift_ns);
        }
    }
}
