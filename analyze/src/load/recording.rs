//! The samples of one sensor in a log.

use std::io;
use std::ops::Range;
use std::sync::OnceLock;

use tipwatch_ingest::{
    ClockFinding, SensorRecording, StampCorrection, StampDecision, TimeBase, TopicStatistics,
};

use super::column::Column;

/// Number of samples read from a file at a time.
const CHUNK: usize = 1024;

/// All samples of one sensor, in file order. Those of a long log are in a temporary file, except for their stamps.
#[derive(Debug)]
pub struct Recording {
    /// The time source, and why it was chosen.
    pub clock: StampDecision,
    /// How the stamps were mapped to the clock of the log.
    pub correction: StampCorrection,
    /// Findings about the clocks.
    pub findings: Vec<ClockFinding>,
    /// The common clock of all sensors of the log.
    pub time_base: TimeBase,
    /// Time of measurement of each sample, on the clock of the log.
    pub stamps_ns: Vec<i64>,
    /// When the recorder received the first and the last sample (ns); `None` without samples.
    pub log_span_ns: Option<(i64, i64)>,
    /// Rates, gaps and offsets of the stamps.
    pub statistics: TopicStatistics,
    /// Messages that could not be decoded.
    pub undecodable: u64,
    /// Messages without a usable stamp, which are omitted.
    pub unstamped: u64,
    /// Messages without any number of the sample, which are omitted.
    pub without_value: u64,
    width: usize,
    values: Column<f64>,
    /// Of each sample, when the recorder received it (ns), then its position among the messages read.
    arrivals: Column<i64>,
    /// Whether the samples arrived in file order.
    arrived_in_order: bool,
    failure: OnceLock<String>,
}

/// When a sample arrived: log time (ns) and position among the messages read.
pub(super) type Arrival = [i64; 2];

impl Recording {
    /// Takes over the samples of a recording, into temporary files where `in_files`.
    ///
    /// # Errors
    /// A file cannot be written.
    pub(super) fn new(recording: SensorRecording, in_files: bool) -> io::Result<Self> {
        let order = recording.order().iter().map(|&order| i64::from(order));
        let arrivals = recording.log_times_ns.iter().copied().zip(order);
        let log_times = || recording.log_times_ns.iter().copied();
        let arrived_in_order = arrivals.clone().is_sorted();
        let log_span_ns = log_times().min().zip(log_times().max());
        let mut arrivals = Column::Memory(arrivals.flat_map(Arrival::from).collect());
        let mut values = Column::Memory(recording.values);
        if in_files {
            arrivals.move_to_file()?;
            values.move_to_file()?;
        }
        Ok(Self {
            clock: recording.clock,
            correction: recording.correction,
            findings: recording.findings,
            time_base: recording.time_base,
            stamps_ns: recording.stamps_ns,
            log_span_ns,
            statistics: recording.statistics,
            undecodable: recording.undecodable,
            unstamped: recording.unstamped,
            without_value: recording.without_value,
            width: recording.width,
            values,
            arrivals,
            arrived_in_order,
            failure: OnceLock::new(),
        })
    }

    /// The number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.stamps_ns.len()
    }

    /// Whether there is no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stamps_ns.is_empty()
    }

    /// The number of values per sample.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
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
        self.values.read(samples.start * self.width, values)
    }

    /// Reads when the samples from this one on arrived: as many as fit.
    ///
    /// # Errors
    /// The temporary file cannot be read.
    pub(super) fn read_arrivals(&self, first: usize, into: &mut [Arrival]) -> io::Result<()> {
        self.arrivals.read(2 * first, into.as_flattened_mut())
    }

    pub(super) fn arrived_in_order(&self) -> bool {
        self.arrived_in_order
    }

    /// Why samples could not be read, if a [`SampleReader`] met that.
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
        let width = recording.width;
        if let Some(values) = recording.values.in_memory() {
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
        self.values.resize(count * recording.width, f64::NAN);
        self.first = first;
        if let Err(error) = recording.read(first..first + count, &mut self.values) {
            self.values.fill(f64::NAN);
            // The first failure says enough.
            let _ = recording.failure.set(error.to_string());
        }
    }
}
