//! The samples of one sensor in a log.

use std::io;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use tipwatch_ingest::{Placement, SensorReading};
use tipwatch_mechanics::estimation::{FilledVelocities, HeldValues, Together};

use super::log_times::LogTimes;
use super::sample_store::{Arrival, StoredSamples, Times, arrival, message_times};

/// Number of samples read from a file at a time.
const CHUNK: usize = 1024;

/// All samples of one sensor, in file order. Those of a long log are in a temporary file, except for their stamps. A clone has
/// the same samples, at stamps of its own.
#[derive(Debug, Clone)]
pub struct Recording {
    /// Other results of reading the log; the samples are already placed on its clock, and those without a usable stamp omitted.
    pub reading: SensorReading,
    /// Time of measurement of each sample, on the clock of the log.
    pub stamps_ns: Vec<i64>,
    /// Times at which the recorder received the first and the last sample (ns); `None` without samples.
    pub log_span_ns: Option<(i64, i64)>,
    /// The times of the log at the times of measurement.
    pub log_times: LogTimes,
    samples: Arc<StoredSamples>,
    /// Whether the samples arrived in file order.
    arrived_in_order: bool,
    /// Repeats that were left out.
    held: Option<HeldValues>,
    failure: OnceLock<String>,
}

impl Recording {
    /// Puts samples on the clock of the log and omits those without a stamp.
    ///
    /// # Errors
    /// A temporary file cannot be read or written.
    pub(super) fn new(reading: SensorReading, mut samples: StoredSamples) -> io::Result<Self> {
        let mut recording = Self {
            stamps_ns: Vec::with_capacity(reading.samples),
            reading,
            log_span_ns: None,
            log_times: LogTimes::default(),
            samples: Arc::default(),
            arrived_in_order: true,
            held: None,
            failure: OnceLock::new(),
        };
        let mut last = Arrival::default();
        let mut omitted = Vec::new();
        let Self {
            reading,
            stamps_ns,
            log_span_ns,
            log_times,
            arrived_in_order,
            ..
        } = &mut recording;
        let mut times = Vec::new();
        for chunk in chunks(reading.samples) {
            times.resize(chunk.len(), Times::default());
            samples.read_times(chunk.start, &mut times)?;
            for (index, &times) in chunk.zip(&times) {
                let Some(stamp_ns) = reading.placement.stamp_ns(index, &message_times(times))
                else {
                    omitted.push(index);
                    continue;
                };
                stamps_ns.push(stamp_ns);
                let [_, _, log_ns, _] = times;
                log_times.push(stamp_ns, log_ns);
                let (earliest, latest) = log_span_ns.unwrap_or((log_ns, log_ns));
                let arrival = arrival(without_jumps(&reading.placement, index, times));
                *arrived_in_order &= stamps_ns.len() == 1 || last <= arrival;
                *log_span_ns = Some((earliest.min(log_ns), latest.max(log_ns)));
                last = arrival;
            }
        }
        log_times.finish();
        if !omitted.is_empty() || reading.placement.removes_log_jumps() {
            let times = |index, times| without_jumps(&reading.placement, index, times);
            let as_it_is = |sample: &[f64], kept: &mut Vec<f64>| kept.extend_from_slice(sample);
            samples = rewritten(&samples, reading.samples, &omitted, times, as_it_is)?;
        }
        recording.samples = Arc::new(samples);
        Ok(recording)
    }

    /// The number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.stamps_ns.len()
    }

    /// Whether the recording has no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stamps_ns.is_empty()
    }

    /// The number of values per sample.
    #[must_use]
    pub fn width(&self) -> usize {
        self.samples.width
    }

    /// The joints whose velocity the driver fills with zeros, by their place in a sample of joint states: NaN takes its place.
    pub(super) fn filled_velocities(&self) -> impl Iterator<Item = usize> {
        let filled = self.samples.filled_velocities.iter();
        filled.flat_map(FilledVelocities::filled)
    }

    /// Puts NaN in place of the velocities that the driver fills with zeros from the first sample on: the whole log shows that
    /// nobody measures them.
    ///
    /// # Errors
    /// A temporary file cannot be read or written.
    pub(super) fn leave_out_filled_velocities(&mut self) -> io::Result<()> {
        let joints = self.samples.width / 2;
        let filled: Vec<usize> = self.filled_velocities().collect();
        if !filled.is_empty() {
            let leave_out = |sample: &[f64], kept: &mut Vec<f64>| {
                let first = kept.len() + joints;
                kept.extend_from_slice(sample);
                (filled.iter()).for_each(|place| kept[first + place] = f64::NAN);
            };
            let count = self.len();
            let rewritten = rewritten(&self.samples, count, &[], |_, times| times, leave_out)?;
            self.samples = Arc::new(rewritten);
        }
        Ok(())
    }

    /// Repeats of a held value that were left out.
    pub(super) fn held_values(&self) -> Option<&HeldValues> {
        self.held.as_ref()
    }

    /// Leaves out the samples that only repeat the last value of the sensor. Where some of its joints (their number; `None` for
    /// another sensor) are measured at other instants than the rest, it becomes one recording for each of these groups; the places
    /// of their joints are beside them.
    ///
    /// # Errors
    /// A temporary file cannot be read or written.
    pub(super) fn without_repeats(
        mut self,
        joints: Option<usize>,
    ) -> io::Result<Vec<(Vec<usize>, Self)>> {
        let width = self.samples.width;
        let parts: Vec<Vec<usize>> = match joints {
            Some(joints) if width > 0 => (0..joints).map(|j| vec![j, joints + j]).collect(),
            _ => vec![(0..width).collect()],
        };
        let mut reader = self.reader();
        let read = |index: usize, take: &mut dyn FnMut(&[f64])| take(reader.sample(index));
        let found = HeldValues::among(&self.stamps_ns, &parts, read);
        if let Some(failure) = self.failure() {
            return Err(io::Error::other(failure.to_owned()));
        }
        if let [Together { held: None, .. }] = &found[..] {
            return Ok(vec![((0..joints.unwrap_or(0)).collect(), self)]);
        }
        let whole = std::mem::take(&mut self.samples);
        let count = self.stamps_ns.len();
        let part = |Together { parts: own, held }: Together| {
            let values = own.iter().map(|&part| parts[part].as_slice());
            let places: Vec<usize> = match joints {
                // positions, then velocities
                Some(_) => (0..2)
                    .flat_map(|value| values.clone().map(move |part| part[value]))
                    .collect(),
                None => values.flatten().copied().collect(),
            };
            let repeats = held.as_ref().map_or(&[][..], |held| &held.repeats);
            let mut kept = rewritten(
                &whole,
                count,
                repeats,
                |_, times| times,
                |sample, kept| {
                    kept.extend(places.iter().map(|&place| sample[place]));
                },
            )?;
            kept.width = places.len();
            let filled = kept.filled_velocities.as_ref();
            kept.filled_velocities = filled.map(|filled| filled.of(&own));
            let mut next_repeat = repeats.iter().copied().peekable();
            let mut index = 0..;
            let mut recording = self.clone();
            recording.stamps_ns.retain(|_| {
                let index = index.next().unwrap_or_default();
                next_repeat.next_if_eq(&index).is_none()
            });
            recording.samples = Arc::new(kept);
            recording.held = held;
            Ok((own, recording))
        };
        found.into_iter().map(part).collect()
    }

    /// Frees the memory of the samples, which nobody reads any more.
    pub(super) fn forget_samples(&mut self) {
        self.samples = Arc::default();
    }

    /// Whether the first number of the samples has shown two finite values.
    pub(crate) fn has_changed(&self) -> bool {
        let mut reader = self.reader();
        let numbers = (0..self.len()).map(|index| reader.sample(index)[0]);
        let mut numbers = numbers.filter(|number| number.is_finite());
        let first = numbers.next();
        numbers.any(|number| Some(number) != first)
    }

    /// Reads samples one at a time.
    #[must_use]
    pub fn reader(&self) -> SampleReader<'_> {
        SampleReader {
            recording: self,
            first: 0,
            values: Vec::new(),
        }
    }

    /// Fills `values` with those of the samples with these indices, see [`SensorSample`](tipwatch_ingest::SensorSample).
    ///
    /// # Errors
    /// The temporary file cannot be read.
    pub fn read(&self, samples: Range<usize>, values: &mut [f64]) -> io::Result<()> {
        let width = self.samples.width;
        self.samples.values.read(samples.start * width, values)
    }

    /// Reads when the samples from this one on arrived: as many as fit.
    ///
    /// # Errors
    /// The temporary file cannot be read.
    pub(super) fn read_arrivals(&self, first: usize, into: &mut [Arrival]) -> io::Result<()> {
        let mut times = vec![Times::default(); into.len()];
        self.samples.read_times(first, &mut times)?;
        for (into, times) in into.iter_mut().zip(times) {
            *into = arrival(times);
        }
        Ok(())
    }

    pub(super) fn arrived_in_order(&self) -> bool {
        self.arrived_in_order
    }

    /// Returns the error for which a [`SampleReader`] could not read samples, if there was one.
    #[must_use]
    pub fn failure(&self) -> Option<&str> {
        self.failure.get().map(String::as_str)
    }

    /// Shifts every stamp by `seconds`: a clock offset from the machine file, or an estimated one.
    pub fn shift(&mut self, seconds: f64) {
        let shift_ns = (seconds * 1e9).round() as i64;
        for stamp in &mut self.stamps_ns {
            *stamp = stamp.saturating_add(shift_ns);
        }
        self.log_times.shift(shift_ns);
    }
}

/// Reads the samples of a recording one at a time, in any order; fastest in theirs.
#[derive(Debug)]
pub struct SampleReader<'r> {
    recording: &'r Recording,
    /// Index of the first sample in `values`.
    first: usize,
    values: Vec<f64>,
}

impl SampleReader<'_> {
    /// The values of one sample. They are NaN where it cannot be read, and the recording has a
    /// [`failure`](Recording::failure).
    pub fn sample(&mut self, index: usize) -> &[f64] {
        let Self { recording, .. } = *self;
        let width = recording.samples.width;
        if let Some(values) = recording.samples.values.in_memory() {
            return &values[index * width..(index + 1) * width];
        }
        let read = self.values.len() / width.max(1);
        if !(self.first..self.first + read).contains(&index) {
            self.read(index);
        }
        let from = (index - self.first) * width;
        &self.values[from..from + width]
    }

    fn read(&mut self, first: usize) {
        let recording = self.recording;
        let count = CHUNK.min(recording.len().saturating_sub(first)).max(1);
        self.values
            .resize(count * recording.samples.width, f64::NAN);
        self.first = first;
        if let Err(error) = recording.read(first..first + count, &mut self.values) {
            self.values.fill(f64::NAN);
            // The first failure says enough.
            let _ = recording.failure.set(error.to_string());
        }
    }
}

/// Samples that are read at a time.
fn chunks(count: usize) -> impl Iterator<Item = Range<usize>> {
    let firsts = (0..count).step_by(CHUNK);
    firsts.map(move |first| first..count.min(first + CHUNK))
}

/// The times of a message without jumps of the recorder's clock, so that they tell the order of arrival.
fn without_jumps(placement: &Placement, index: usize, times: Times) -> Times {
    let [header_ns, publish_ns, log_ns, order] = times;
    [
        header_ns,
        publish_ns,
        placement.log_ns(index, log_ns),
        order,
    ]
}

/// The samples with other times and values, and without those that are omitted, given by index in rising order. `write` appends the
/// values that are kept of a sample.
fn rewritten(
    samples: &StoredSamples,
    count: usize,
    omitted: &[usize],
    other_times: impl Fn(usize, Times) -> Times,
    write: impl Fn(&[f64], &mut Vec<f64>),
) -> io::Result<StoredSamples> {
    let mut kept = samples.emptied()?;
    let mut omitted = omitted.iter().copied().peekable();
    let (mut times, mut values, mut kept_values) = (Vec::new(), Vec::new(), Vec::new());
    let width = samples.width;
    for chunk in chunks(count) {
        times.resize(chunk.len(), Times::default());
        values.resize(chunk.len() * width, 0.0);
        samples.read_times(chunk.start, &mut times)?;
        samples.values.read(chunk.start * width, &mut values)?;
        kept_values.clear();
        let mut count = 0;
        for (k, index) in chunk.enumerate() {
            if omitted.next_if_eq(&index).is_none() {
                times[count] = other_times(index, times[k]);
                write(&values[k * width..(k + 1) * width], &mut kept_values);
                count += 1;
            }
        }
        kept.times.append(times[..count].as_flattened())?;
        kept.values.append(&kept_values)?;
    }
    Ok(kept)
}
