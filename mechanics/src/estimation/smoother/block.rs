//! The smoother, block by block.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::forward::{Forward, Passes};
use super::history_reader::HistoryReader;
use super::pass::Run;
use super::sorted_samples::{Chunk, SortedSamples};
use super::source::SampleSource;
use crate::estimation::followed::Followed;
use crate::estimation::kalman_filter::KalmanFilter;
use crate::estimation::plausibility::{FaultSpan, SpanWalk};
use crate::estimation::reading::Reading;
use crate::estimation::rows::{
    EstimatedStates, RowClock, regular_index, regular_row, regular_stamp,
};
use crate::estimation::shown_noise::ShownNoise;
use crate::estimation::state_builder::{Filters, StateBuilder};
use crate::estimation::white_jerk::{Channel, seconds};
use crate::machine::{ForceSource, Machine, SessionProofs};
use crate::state::{Sensor, Sensors, State, StreamCounts};

/// A usual number of rows in a block.
pub const ROWS_PER_BLOCK: usize = 1024;
/// Usual number of samples after a block that matter to it.
const USUAL_STEPS_AFTER: usize = 128;

/// Smooths a recording block by block, the same as [`smooth`](super::smooth) does the whole of it. Samples of a sensor
/// are sorted by stamp; of equal stamps only one is used, and of several sources of one sensor the first.
///
/// Rows are at the samples of the first stream of joint states, or at a regular rate. Blocks are independent of each
/// other: threads smooth them with a [`BlockWorker`] each, in any order.
#[derive(Debug)]
pub struct BlockSmoother<S> {
    sensors: Sensors,
    samples: Vec<SortedSamples<S>>,
    /// Its filters are of each sensor, in the order of `samples`.
    forward: Forward,
    times_ns: Vec<i64>,
    rows_per_block: usize,
    max_gap_ns: i64,
    /// Memory that no worker uses at the moment.
    idle: Mutex<Vec<Bench>>,
}

impl<S: SampleSource> BlockSmoother<S> {
    /// Reads all samples: finds implausible spans and the bias of the accelerometer, and where each block starts. `run`
    /// runs the passes that it is given, which are independent of each other, on one thread or on several; it is called
    /// several times.
    ///
    /// # Errors
    /// Samples cannot be read.
    pub fn new(
        machine: &Machine,
        sensors: &Sensors,
        sources: Vec<S>,
        clock: RowClock,
        rows_per_block: usize,
        run: Run<'_>,
    ) -> Result<Self, S::Error> {
        let mut samples: Vec<SortedSamples<S>> = Vec::with_capacity(sources.len());
        for source in sources {
            let is_known = (samples.iter()).any(|known| known.sensor() == source.sensor());
            samples.extend(SortedSamples::new(source, sensors).filter(|_| !is_known));
        }
        let max_gap_ns = (machine.estimator().max_gap * 1e9) as i64;
        let joints = samples.iter().find(|s| s.sensor() == Sensor::Joints(0));
        let times_ns = joints.map_or(Vec::new(), |joints| {
            let longest_ns = machine.longest_known_gap_ns();
            row_times(joints.distinct_stamps_ns(), clock, longest_ns)
        });
        let rows_per_block = rows_per_block.max(1);
        let starts_ns: Vec<i64> = times_ns.iter().step_by(rows_per_block).copied().collect();
        let passes = Passes {
            machine,
            sensors,
            samples: &samples,
            starts_ns: &starts_ns,
        };
        let forward = passes.run(run)?;
        Ok(Self {
            sensors: sensors.clone(),
            samples,
            forward,
            times_ns,
            rows_per_block,
            max_gap_ns,
            idle: Mutex::default(),
        })
    }

    /// Times of all rows (ns).
    #[must_use]
    pub fn row_times_ns(&self) -> &[i64] {
        &self.times_ns
    }

    /// Number of blocks.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.times_ns.len().div_ceil(self.rows_per_block)
    }

    /// The rows of a block.
    #[must_use]
    pub fn rows(&self, block: usize) -> Range<usize> {
        let rows = self.times_ns.len();
        let at = |block: usize| block.saturating_mul(self.rows_per_block).min(rows);
        at(block)..at(block.saturating_add(1))
    }

    /// Number of samples used and not used, by sensor.
    pub fn counts(&self) -> impl Iterator<Item = (Sensor, StreamCounts)> {
        let sensors = self.samples.iter().zip(&self.forward.tracks);
        sensors.map(|(samples, track)| (samples.sensor(), track.counts))
    }

    /// The noise that the samples show, beside the stated one.
    #[must_use]
    pub fn shown_noise(&self) -> Vec<ShownNoise> {
        let tracks = self.forward.tracks.iter();
        tracks
            .flat_map(|track| track.shown_noise.iter().copied())
            .collect()
    }

    /// Implausible spans of the signals, sorted by start.
    #[must_use]
    pub fn faults(&self) -> &[FaultSpan] {
        &self.forward.found.faults
    }

    /// Proofs and doubts about the sensors by the whole recording.
    #[must_use]
    pub fn shown(&self) -> SessionProofs {
        self.forward.found.shown
    }

    /// The probability that each joint of the arm has the other sign, by index, as the whole recording shows it; none where
    /// nothing compares them.
    #[must_use]
    pub fn reversed(&self) -> &[(usize, f64)] {
        &self.forward.found.reversed
    }

    /// A worker for one thread. `machine` must differ from that of [`BlockSmoother::new`] by its masses at most.
    #[must_use]
    pub fn worker<'b>(&'b self, machine: &'b Machine) -> BlockWorker<'b, S> {
        BlockWorker {
            smoother: self,
            machine,
        }
    }

    fn idle(&self) -> MutexGuard<'_, Vec<Bench>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Smooths blocks, one at a time. Its memory is kept for the next worker.
#[derive(Debug)]
pub struct BlockWorker<'b, S> {
    smoother: &'b BlockSmoother<S>,
    machine: &'b Machine,
}

/// Reusable memory for smoothing a block.
#[derive(Debug)]
struct Bench {
    filters: Filters,
    /// Memory for the samples of each sensor.
    chunks: Vec<Chunk>,
    state_builder: StateBuilder,
    state: State<f64>,
}

impl<S: SampleSource> BlockWorker<'_, S> {
    /// Replaces the rows of `into` by those of a block; none where there is no such block.
    ///
    /// # Errors
    /// Samples cannot be read.
    pub fn smooth(&mut self, block: usize, into: &mut EstimatedStates) -> Result<(), S::Error> {
        let times_ns = &self.smoother.times_ns[self.smoother.rows(block)];
        into.states.resize(times_ns.len());
        into.reasons.clear();
        let Some(&end_ns) = times_ns.last() else {
            return Ok(());
        };
        let (smoother, machine) = (self.smoother, self.machine);
        let idle = smoother.idle().pop();
        let mut bench = idle.unwrap_or_else(|| Bench::new(machine, smoother));
        let filtered = (0..smoother.samples.len())
            .try_for_each(|sensor| bench.filter(smoother, sensor, block, end_ns));
        if filtered.is_ok() {
            for (_, filter) in &mut bench.filters.list {
                filter.smooth();
            }
            bench.fill(smoother, machine, times_ns, into);
        }
        smoother.idle().push(bench);
        filtered
    }
}

impl Bench {
    fn new<S>(machine: &Machine, smoother: &BlockSmoother<S>) -> Self {
        let sensors = &smoother.sensors;
        Self {
            filters: Filters::new(machine, sensors, true),
            chunks: vec![Chunk::default(); smoother.samples.len()],
            state_builder: StateBuilder::new(machine, sensors),
            state: State::zero(machine),
        }
    }

    /// Runs a sensor's filters from the start of a block until samples no longer matter to its rows, the last of them
    /// at `end_ns`.
    fn filter<S: SampleSource>(
        &mut self,
        smoother: &BlockSmoother<S>,
        sensor: usize,
        block: usize,
        end_ns: i64,
    ) -> Result<(), S::Error> {
        let (samples, track, chunk) = (
            &smoother.samples[sensor],
            &smoother.forward.tracks[sensor],
            &mut self.chunks[sensor],
        );
        let sensor = samples.sensor();
        let start = &track.starts[block];
        let steps = samples.first_after(end_ns).saturating_sub(start.sample) + USUAL_STEPS_AFTER;
        let filters = self.filters.fed_by(sensor).zip(&start.filters);
        for ((_, filter), state) in filters {
            filter.restart(state, end_ns, steps);
        }
        self.filters.has_tilt = track.measures_tilt;
        let Some(first_ns) = samples.stamp_ns(start.sample) else {
            return Ok(());
        };
        let mut walk = track.faults_from(first_ns);
        let mut last_ns = None;
        for k in start.sample..samples.len() {
            let Some(sample) = samples.sample(k, chunk)? else {
                break;
            };
            let stamp_ns = sample.stamp_ns;
            let is_past = |(_, filter): &mut (Followed, KalmanFilter)| filter.is_past(stamp_ns);
            if stamp_ns > end_ns && self.filters.fed_by(sensor).all(is_past) {
                break;
            }
            if last_ns.replace(stamp_ns) != Some(stamp_ns) {
                // Counted in the forward pass.
                let _ = self.filters.push(&sample, &walk.judgement(stamp_ns), &[]);
            }
        }
        Ok(())
    }

    fn fill<S>(
        &mut self,
        smoother: &BlockSmoother<S>,
        machine: &Machine,
        times_ns: &[i64],
        into: &mut EstimatedStates,
    ) {
        let &[start_ns, ..] = times_ns else {
            return;
        };
        let mut readers: Vec<(Followed, HistoryReader<'_>)> = (self.filters.list.iter())
            .filter_map(|(followed, filter)| {
                let last_ns = filter.last_ns();
                let mut tracks = smoother.forward.tracks.iter();
                let goes_on = tracks.any(|track| track.goes_on(*followed, last_ns));
                let reader = HistoryReader::new(filter.history()?, smoother.max_gap_ns, goes_on);
                Some((*followed, reader))
            })
            .collect();
        let faults = smoother.forward.found.faults.iter();
        let is_later = |until_ns: Option<i64>| until_ns.is_none_or(|until| until > start_ns);
        let mut walk = SpanWalk::new(faults.filter(|span| is_later(span.until_ns)));
        let first_ns = smoother.times_ns.first().copied().unwrap_or(start_ns);
        let hold_ns =
            (machine.is_quasi_static()).then(|| (machine.quasi_static().hold * 1e9) as i64);
        for (row, &time_ns) in times_ns.iter().enumerate() {
            let mut read = |followed: Followed, channels: &mut [Channel]| {
                let mut readers = readers.iter_mut();
                match readers.find(|(f, _)| *f == followed) {
                    Some((_, reader)) => match hold_ns {
                        Some(hold_ns) => {
                            let reading = reader.read_or_hold(time_ns, hold_ns, channels);
                            let is_known = match followed {
                                Followed::Actuator(signal) => {
                                    let joint = smoother.sensors.actuators[signal].joint;
                                    let source = &machine.contact().actuated_joints[joint].source;
                                    is_force_known(reader, source, time_ns)
                                }
                                _ => true,
                            };
                            if is_known { reading } else { Reading::NOTHING }
                        }
                        None => reader.read(time_ns, channels),
                    },
                    None => Reading::NOTHING,
                }
            };
            let effect = walk.row_effect(time_ns, machine, smoother.sensors.imu);
            let elapsed_s = seconds(time_ns.saturating_sub(first_ns));
            let reasons = self.state_builder.assemble(
                machine,
                elapsed_s,
                &effect,
                &smoother.forward.bias.at(time_ns),
                &mut read,
                &mut self.state,
            );
            into.states.set(row, &mut self.state);
            into.reasons.push(reasons);
        }
    }
}

/// Whether the force of an actuator, as last read for a static row, is that of the row. A force is not held: that of a rod belongs to
/// the accelerations of its own moment, which a static row does not know. The load of a support is what it is at the stamp of
/// its sample.
fn is_force_known(reader: &HistoryReader<'_>, source: &ForceSource, time_ns: i64) -> bool {
    let is_load = matches!(source, ForceSource::Support { .. });
    reader.was_dense(time_ns) || (is_load && reader.was_at_sample(time_ns))
}

/// A gap in the joint states longer than this separates recordings, or its stamps are wrong (ns).
const LONGEST_GRID_NS: i64 = 3_600_000_000_000;

/// Row times. A gap in the joint states gets a single row in its middle, so that tables and curves show it.
/// At a regular rate this applies only to gaps longer than [`LONGEST_GRID_NS`].
fn row_times(
    joint_stamps_ns: impl Iterator<Item = i64>,
    clock: RowClock,
    max_gap_ns: i64,
) -> Vec<i64> {
    let mut joint_stamps_ns = joint_stamps_ns.peekable();
    let Some(&first) = joint_stamps_ns.peek() else {
        return Vec::new();
    };
    let usual_count = joint_stamps_ns.size_hint().1.unwrap_or(0);
    let mut times = Vec::with_capacity(usual_count);
    let (mut before, mut next) = (first, 0);
    for stamp in joint_stamps_ns {
        let gap_ns = stamp.saturating_sub(before);
        let longest_ns = match clock {
            RowClock::JointStates => max_gap_ns,
            RowClock::Rate(_) => LONGEST_GRID_NS.max(max_gap_ns),
        };
        if gap_ns > longest_ns {
            times.push(before.midpoint(stamp));
        }
        match clock {
            RowClock::JointStates => times.push(stamp),
            RowClock::Rate(hz) => {
                let is_before = |k: u64| regular_stamp(first, k, hz) < stamp;
                if gap_ns > longest_ns {
                    next = regular_index(first, stamp, hz);
                    next += (next..).take_while(|&k| is_before(k)).count() as u64;
                }
                while let Some(time_ns) = regular_row(first, next, hz, stamp) {
                    times.push(time_ns);
                    next += 1;
                }
            }
        }
        before = stamp;
    }
    times
}
