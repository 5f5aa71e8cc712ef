//! The samples decoded from a part of a log, such as one chunk.

use std::ops::Range;

use super::decoder::{Decoded, Decoder};
use crate::{
    clock::{Times, TimesSlice},
    decode::{DecodeError, SensorSample},
    message::{RawMessage, TopicId},
};

/// Consecutive samples of one sensor, in file order.
#[derive(Debug, Default)]
pub(crate) struct Samples {
    pub(crate) times: Times,
    /// Position of each sample among the messages read.
    pub(crate) order: Vec<u32>,
    /// The values, sample after sample.
    pub(crate) values: Vec<f64>,
}

/// Borrowed samples of one sensor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SamplesSlice<'s> {
    pub(crate) times: TimesSlice<'s>,
    pub(crate) order: &'s [u32],
    pub(crate) values: &'s [f64],
    /// The number of values per sample.
    pub(crate) width: usize,
}

impl Samples {
    pub(crate) fn len(&self) -> usize {
        self.order.len()
    }

    pub(crate) fn as_slice(&self, width: usize) -> SamplesSlice<'_> {
        SamplesSlice {
            times: self.times.as_slice(),
            order: &self.order,
            values: &self.values,
            width,
        }
    }

    pub(crate) fn append(&mut self, next: SamplesSlice<'_>) {
        self.times.append(next.times);
        self.order.extend_from_slice(next.order);
        self.values.extend_from_slice(next.values);
    }

    /// Reserves memory for so many samples, if it is available.
    fn reserve(&mut self, samples: usize, width: usize) {
        self.times.reserve_exact(samples);
        let _ = self.order.try_reserve_exact(samples);
        let _ = self.values.try_reserve_exact(samples.saturating_mul(width));
    }

    /// Removes all samples, keeping the memory.
    pub(crate) fn clear(&mut self) {
        self.times.clear();
        self.order.clear();
        self.values.clear();
    }
}

impl SamplesSlice<'_> {
    pub(crate) fn len(self) -> usize {
        self.order.len()
    }

    /// Part of the samples.
    pub(crate) fn part(self, range: Range<usize>) -> Self {
        Self {
            times: self.times.part(range.clone()),
            order: &self.order[range.clone()],
            values: &self.values[range.start * self.width..range.end * self.width],
            width: self.width,
        }
    }
}

/// The samples of all requested sensors from a part of a log.
pub(crate) struct Part {
    pub(crate) sensors: Vec<PartOfSensor>,
    /// The number of messages taken.
    pub(crate) messages: u32,
}

/// The samples of one sensor from a part of a log.
pub(crate) struct PartOfSensor {
    pub(crate) topic: TopicId,
    pub(crate) decoder: Decoder,
    pub(crate) width: usize,
    pub(crate) samples: Samples,
    pub(crate) undecodable: u64,
    pub(crate) without_value: u64,
    pub(crate) of_other_frames: u64,
    scratch: SensorSample,
}

impl Part {
    pub(crate) fn new(sensors: impl Iterator<Item = PartOfSensor>) -> Self {
        Self {
            sensors: sensors.collect(),
            messages: 0,
        }
    }

    /// Decodes a message of a requested topic.
    #[inline]
    pub(crate) fn take(&mut self, message: &RawMessage<'_>) {
        for sensor in &mut self.sensors {
            if sensor.topic == message.topic {
                sensor.take(message, self.messages);
            }
        }
        self.messages += 1;
    }
}

impl PartOfSensor {
    pub(crate) fn new(topic: TopicId, decoder: Decoder, width: usize) -> Self {
        Self {
            topic,
            decoder,
            width,
            samples: Samples::default(),
            undecodable: 0,
            without_value: 0,
            of_other_frames: 0,
            scratch: SensorSample::default(),
        }
    }

    /// Reserves memory for so many samples.
    pub(crate) fn reserve(&mut self, samples: usize) {
        self.samples.reserve(samples, self.width);
    }

    #[inline]
    fn take(&mut self, message: &RawMessage<'_>, order: u32) {
        let values = &mut self.samples.values;
        let before = values.len();
        let decoded = self
            .decoder
            .append_values(message, &mut self.scratch, values);
        match decoded {
            Ok(Decoded::Sample { header_stamp_ns }) if values.len() == before + self.width => {
                let (publish, log) = (message.publish_time_ns, message.log_time_ns);
                self.samples.times.push(header_stamp_ns, publish, log);
                self.samples.order.push(order);
            }
            Ok(Decoded::WithoutValue) => self.without_value += 1,
            Ok(Decoded::OfOtherJoints) => {}
            Err(DecodeError::OtherFrame) => self.of_other_frames += 1,
            _ => {
                values.truncate(before);
                self.undecodable += 1;
            }
        }
    }
}
