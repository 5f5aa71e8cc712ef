//! Reads the samples of a log's sensors in blocks, so that no column is held whole.

use std::ops::Range;

use super::{
    merged_parts,
    part::{Samples, SamplesSlice},
    pass::{Sink, pass},
    record_sensors::sensors_of,
    sensor_reading::SensorReading,
    sensor_recording::{SensorRecording, SensorRequest},
    whole_columns::Columns,
};
use crate::{
    clock::{MessageTimes, TimesSlice},
    log::Log,
    message::{Error, Losses},
};

/// The most samples in a block.
const MOST_SAMPLES: usize = 4096;
/// Fewer samples from one chunk are collected into a larger block.
const LEAST_SAMPLES: usize = 1024;

/// Consecutive samples of one sensor, in file order, borrowed during a callback.
#[derive(Debug, Clone, Copy)]
pub struct SensorBlock<'a> {
    /// Index of the sensor's request.
    pub sensor: usize,
    /// Index of the first sample among all samples of the sensor.
    pub first: usize,
    samples: SamplesSlice<'a>,
}

impl<'a> SensorBlock<'a> {
    /// The number of samples: some thousand at most.
    #[must_use]
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether the block has no samples; never so in a callback.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The number of values per sample.
    #[must_use]
    pub fn width(&self) -> usize {
        self.samples.width
    }

    /// The values, sample after sample: see [`SensorSample`](crate::SensorSample).
    #[must_use]
    pub fn values(&self) -> &'a [f64] {
        self.samples.values
    }

    /// The times of each sample. [`Placement::stamp_ns`](crate::Placement::stamp_ns) turns them into times of measurement, once
    /// the whole log has been read.
    pub fn times(&self) -> impl ExactSizeIterator<Item = MessageTimes> + Clone + 'a {
        self.samples.times.iter()
    }

    /// Position of each sample among the messages read, in file order.
    #[must_use]
    pub fn order(&self) -> &'a [u32] {
        self.samples.order
    }
}

/// Reads all samples of the wanted sensors in one pass over the log and passes them to `take` in
/// blocks whose memory is reused.
///
/// The blocks of one sensor come in file order. Those of different sensors come in no particular
/// order, because rare samples are collected for longer. Sensors with
/// [`other_parts`](SensorRequest::other_parts) are merged when the whole log has been read; they
/// are held in memory until then, and their blocks come last.
///
/// Which clock the samples are on is known at the end only: see [`SensorReading::placement`].
/// Concatenated and placed, the blocks equal the columns of
/// [`record_sensors`](crate::record_sensors).
///
/// `progress` is called from time to time with the number of bytes read so far.
///
/// # Errors
/// A topic does not carry its kind of sensor, or the log cannot be read. Damage is reported in the
/// losses.
pub fn read_sensor_blocks(
    log: &Log,
    requests: &[SensorRequest],
    take: &mut dyn FnMut(&SensorBlock<'_>),
    progress: &mut dyn FnMut(u64),
) -> Result<(Vec<SensorReading>, Losses), Error> {
    let wanted = sensors_of(log, requests)?;
    let mut roles = Vec::with_capacity(wanted.len());
    for (place, request) in requests.iter().enumerate() {
        match request.other_parts.len() {
            0 => roles.push(Role::InBlocks(place, BlockQueue::default())),
            others => roles.extend((0..=others).map(|_| Role::ToBeMerged(Columns::default()))),
        }
    }
    let mut sink = BlockSink {
        roles,
        take: &mut *take,
    };
    let passed = pass(log, wanted, &mut sink, progress)?;
    sink.flush();
    let roles = sink.roles;
    let time_base = &passed.time_base;
    let mut sensors = passed.sensors.into_iter().zip(roles);
    let mut readings = Vec::with_capacity(requests.len());
    for (place, request) in requests.iter().enumerate() {
        let of_request = sensors.by_ref().take(1 + request.other_parts.len());
        let mut to_be_merged = Vec::new();
        for (sensor, role) in of_request {
            match role {
                Role::InBlocks(..) => {
                    let (mut reading, times) = sensor.place(time_base);
                    reading.unstamped = reading.placement.unstamped(&times);
                    readings.push(reading);
                }
                Role::ToBeMerged(columns) => to_be_merged.push(columns.finish(sensor, time_base)),
            }
        }
        let merged = merged_parts::join_all(request, to_be_merged.into_iter());
        if let Some(merged) = merged {
            let mut queue = BlockQueue::default();
            queue.take(place, samples_of(&merged), take);
            queue.flush(place, take);
            readings.push(merged.reading);
        }
    }
    Ok((readings, passed.losses))
}

/// Passes samples on in blocks.
struct BlockSink<'t> {
    /// Roles of the sensors of the pass.
    roles: Vec<Role>,
    take: &'t mut dyn FnMut(&SensorBlock<'_>),
}

/// Role of a sensor's samples in the pass.
enum Role {
    /// The samples are passed on in blocks, for the request with this index.
    InBlocks(usize, BlockQueue),
    /// The samples are part of a request with other parts.
    ToBeMerged(Columns),
}

impl Sink for BlockSink<'_> {
    fn take(&mut self, sensor: usize, samples: SamplesSlice<'_>) {
        match &mut self.roles[sensor] {
            Role::InBlocks(request, queue) => queue.take(*request, samples, self.take),
            Role::ToBeMerged(columns) => columns.append(samples),
        }
    }
}

impl BlockSink<'_> {
    fn flush(&mut self) {
        for role in &mut self.roles {
            if let Role::InBlocks(request, queue) = role {
                queue.flush(*request, self.take);
            }
        }
    }
}

/// Forms blocks of a useful size: large pieces are passed on where they are, small ones are
/// collected.
#[derive(Default)]
struct BlockQueue {
    collected: Samples,
    width: usize,
    /// Samples passed on so far.
    passed_on: usize,
}

impl BlockQueue {
    fn take(
        &mut self,
        request: usize,
        samples: SamplesSlice<'_>,
        take: &mut dyn FnMut(&SensorBlock<'_>),
    ) {
        self.width = samples.width;
        let mut from = 0;
        while from < samples.len() {
            let rest = samples.len() - from;
            let is_passed_on = self.collected.len() == 0 && rest >= LEAST_SAMPLES;
            let range: Range<usize> = match is_passed_on {
                true => from..from + rest.min(MOST_SAMPLES),
                false => from..from + rest.min(MOST_SAMPLES - self.collected.len()),
            };
            from = range.end;
            let samples = samples.part(range);
            if is_passed_on {
                self.pass_on(request, samples, take);
                continue;
            }
            self.collected.append(samples);
            if self.collected.len() >= LEAST_SAMPLES {
                self.flush(request, take);
            }
        }
    }

    /// Passes on the collected samples.
    fn flush(&mut self, request: usize, take: &mut dyn FnMut(&SensorBlock<'_>)) {
        let mut collected = std::mem::take(&mut self.collected);
        if collected.len() > 0 {
            self.pass_on(request, collected.as_slice(self.width), take);
        }
        collected.clear();
        self.collected = collected;
    }

    fn pass_on(
        &mut self,
        request: usize,
        samples: SamplesSlice<'_>,
        take: &mut dyn FnMut(&SensorBlock<'_>),
    ) {
        let first = self.passed_on;
        self.passed_on += samples.len();
        take(&SensorBlock {
            sensor: request,
            first,
            samples,
        });
    }
}

fn samples_of(merged: &SensorRecording) -> SamplesSlice<'_> {
    SamplesSlice {
        times: TimesSlice::of_placed(&merged.stamps_ns, &merged.log_times_ns),
        order: &merged.order,
        values: &merged.values,
        width: merged.width,
    }
}
