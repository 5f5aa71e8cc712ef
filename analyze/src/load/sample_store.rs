//! Collects the samples of all sensors while a log is read.

use std::io;

use tipwatch_ingest::{MessageTimes, SensorBlock};
use tipwatch_mechanics::estimation::FilledVelocities;

use super::column::Column;

/// Marks a message without a stamp or, rather, one that is 292 years before zero.
const NO_STAMP: i64 = i64::MIN;

/// The samples of all sensors, in memory while they are few.
#[derive(Debug)]
pub(super) struct SampleStore {
    sensors: Vec<StoredSamples>,
    expected: Vec<Expected>,
    /// Values of a block without velocities that are filled in.
    measured: Vec<f64>,
    /// Values that may still be taken into memory.
    room: usize,
    in_files: bool,
    failure: Option<io::Error>,
}

/// Properties of a sensor that are known before its samples are read.
#[derive(Debug)]
pub(super) struct Expected {
    /// The number of messages, by the index of the log; zero where it is unknown.
    pub(super) messages: u64,
    /// The number of joints in a sample of joint states.
    pub(super) joints: Option<usize>,
}

/// The samples of one sensor, in file order.
#[derive(Debug, Default)]
pub(super) struct StoredSamples {
    /// The number of values per sample; zero without samples.
    pub(super) width: usize,
    /// The values, sample after sample.
    pub(super) values: Column<f64>,
    /// [`Times`] of each sample.
    pub(super) times: Column<i64>,
    /// Velocities that the driver of joint states fills in; NaN takes their place in `values`.
    pub(super) filled_velocities: Option<FilledVelocities>,
}

/// Times of a sample: measured (ns), sent (ns), received by the recorder (ns), and its position among the messages read.
pub(super) type Times = [i64; 4];

/// Log time (ns), and position among the messages read.
pub(super) type Arrival = [i64; 2];

/// Returns the time at which a sample was received, and its position among the messages read.
pub(super) fn arrival([.., log_ns, order]: Times) -> Arrival {
    [log_ns, order]
}

/// Returns the times of a message as the log has them.
pub(super) fn message_times([header_ns, publish_ns, log_ns, _]: Times) -> MessageTimes {
    MessageTimes {
        header_stamp_ns: Some(header_ns).filter(|&stamp| stamp != NO_STAMP),
        publish_time_ns: publish_ns,
        log_time_ns: log_ns,
    }
}

impl SampleStore {
    /// Keeps at most `most_in_memory` values in memory.
    pub(super) fn new(expected: Vec<Expected>, most_in_memory: usize) -> Self {
        let sensors = expected.iter().map(|sensor| StoredSamples {
            filled_velocities: sensor.joints.map(FilledVelocities::new),
            ..StoredSamples::default()
        });
        Self {
            sensors: sensors.collect(),
            expected,
            measured: Vec::new(),
            room: most_in_memory,
            in_files: false,
            failure: None,
        }
    }

    /// Takes a block; does nothing after a failure, which [`Self::finish`] returns.
    pub(super) fn take(&mut self, block: &SensorBlock<'_>) {
        if self.failure.is_none() {
            self.failure = self.try_take(block).err();
        }
    }

    fn try_take(&mut self, block: &SensorBlock<'_>) -> io::Result<()> {
        let values = block.values();
        if !self.in_files && values.len() > self.room {
            self.in_files = true;
            for sensor in &mut self.sensors {
                sensor.values.move_to_file()?;
                sensor.times.move_to_file()?;
            }
        }
        let most_in_memory = self.room;
        self.room = self.room.saturating_sub(values.len());
        let times = block.times().zip(block.order()).map(|(times, &order)| {
            [
                times.header_stamp_ns.unwrap_or(NO_STAMP),
                times.publish_time_ns,
                times.log_time_ns,
                i64::from(order),
            ]
        });
        let times: Vec<Times> = times.collect();
        let sensor = &mut self.sensors[block.sensor];
        if block.first == 0 && !self.in_files {
            let messages = self.expected[block.sensor].messages;
            let expected = usize::try_from(messages).unwrap_or(usize::MAX);
            let fit = expected.min(most_in_memory / block.width().max(1));
            sensor.reserve(fit, block.width());
        }
        sensor.width = block.width();
        match &mut sensor.filled_velocities {
            Some(filled) if !filled.are_all_measured() => {
                self.measured.clear();
                self.measured.extend_from_slice(values);
                let samples = self.measured.chunks_exact_mut(block.width().max(1));
                samples.for_each(|sample| filled.mark(sample));
                sensor.values.append(&self.measured)?;
            }
            _ => sensor.values.append(values)?,
        }
        sensor.times.append(times.as_flattened())
    }

    /// The samples of each sensor.
    pub(super) fn finish(self) -> io::Result<Vec<StoredSamples>> {
        match self.failure {
            Some(failure) => Err(failure),
            None => Ok(self.sensors),
        }
    }
}

impl StoredSamples {
    /// Reserves memory for so many samples: growing would touch twice as much of it.
    fn reserve(&mut self, samples: usize, width: usize) {
        self.values.reserve(samples * width);
        self.times.reserve(samples * Times::default().len());
    }

    /// Reads the times of the samples from the one with index `first` on: as many as fit.
    pub(super) fn read_times(&self, first: usize, into: &mut [Times]) -> io::Result<()> {
        let from = first * Times::default().len();
        self.times.read(from, into.as_flattened_mut())
    }

    /// Empty samples, kept where these are.
    pub(super) fn emptied(&self) -> io::Result<Self> {
        let mut empty = Self {
            width: self.width,
            filled_velocities: self.filled_velocities.clone(),
            ..Self::default()
        };
        if self.values.in_memory().is_none() {
            empty.values.move_to_file()?;
            empty.times.move_to_file()?;
        }
        Ok(empty)
    }
}
