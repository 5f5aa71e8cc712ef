//! The forward pass: implausible spans, the bias of the accelerometer, and where each block of rows starts.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use super::bias_pass::find_bias;
use super::fault_search::{Searched, find_faults};
use super::pass::{Pass, Run};
use super::sorted_samples::{Chunk, SortedSamples};
use super::source::SampleSource;
use crate::estimation::bias::{BiasEstimator, BiasHistory};
use crate::estimation::followed::Followed;
use crate::estimation::kalman_filter::FilterState;
use crate::estimation::plausibility::{FaultSpan, SpanWalk};
use crate::estimation::shown_noise::ShownNoise;
use crate::estimation::state_builder::Filters;
use crate::machine::Machine;
use crate::state::{Credible, SampleError, Sensor, Sensors, StreamCounts, tilt_is_measured};

/// One sensor and its filters over the whole log.
#[derive(Debug)]
pub(super) struct Track {
    pub(super) counts: StreamCounts,
    /// Its implausible spans, sorted by start.
    faults: Vec<FaultSpan>,
    pub(super) measures_tilt: bool,
    pub(super) shown_noise: Vec<ShownNoise>,
    /// State of the filters at the start of each block.
    pub(super) starts: Vec<Start>,
    /// Stamp of the last sample that each of its filters used.
    last_ns: Vec<(Followed, Option<i64>)>,
}

/// A sensor at the first row of a block.
#[derive(Debug)]
pub(super) struct Start {
    /// Index by time of the first sample after this row.
    pub(super) sample: usize,
    /// Its filters before this sample, in the order of [`Filters::fed_by`].
    pub(super) filters: Vec<FilterState>,
}

impl Track {
    /// Walks over the faults from a time on.
    pub(super) fn faults_from(&self, stamp_ns: i64) -> SpanWalk<'_> {
        let spans = self.faults.iter();
        SpanWalk::new(spans.filter(move |span| span.end_ns >= stamp_ns))
    }

    /// Whether a filter has used samples after this stamp.
    pub(super) fn goes_on(&self, followed: Followed, after_ns: Option<i64>) -> bool {
        let mut filters = self.last_ns.iter();
        let last = filters.find(|(f, _)| *f == followed);
        last.is_some_and(|(_, last_ns)| *last_ns > after_ns)
    }
}

/// Result of the forward pass.
#[derive(Debug)]
pub(super) struct Forward {
    pub(super) found: Searched,
    pub(super) bias: BiasHistory,
    /// Filters of each sensor over the whole log.
    pub(super) tracks: Vec<Track>,
}

/// Inputs of the passes.
pub(super) struct Passes<'p, S> {
    pub(super) machine: &'p Machine,
    pub(super) sensors: &'p Sensors,
    pub(super) samples: &'p [SortedSamples<S>],
    /// Times of the first row of each block.
    pub(super) starts_ns: &'p [i64],
}

impl<S: SampleSource> Passes<'_, S> {
    /// Finds implausible spans and the bias, and follows each sensor to where the blocks start. `run` runs passes.
    ///
    /// The treatment of a sample depends on faults that may be found much later. While faults are looked for, all sensors are
    /// followed as if there were none, and then those with faults once more.
    pub(super) fn run(&self, run: Run<'_>) -> Result<Forward, S::Error> {
        let faulty: Vec<AtomicBool> = self.samples.iter().map(|_| AtomicBool::default()).collect();
        let is_faulty = |sensor: usize| faulty[sensor].load(Ordering::Relaxed);
        let of_bias = self.of_bias();
        let is_bias_faulty = || of_bias.iter().any(|&sensor| is_faulty(sensor));
        let (found, bias) = (Slot::default(), Slot::default());
        let tracks: Vec<Slot<_, _>> = self.samples.iter().map(|_| Slot::default()).collect();
        let mut passes: Vec<Pass<'_>> = vec![
            Box::new(|| found.set(self.find_faults(&faulty, run))),
            Box::new(|| bias.set(self.find_bias(&of_bias, &[], &is_bias_faulty, run))),
        ];
        for (sensor, track) in tracks.iter().enumerate() {
            let is_faulty = &is_faulty;
            let follow = move || self.follow(sensor, Vec::new(), &|| is_faulty(sensor));
            passes.push(Box::new(move || track.set(follow())));
        }
        run(passes);
        let found = found.take_or(|| self.find_faults(&faulty, run))?;
        let faults = &found.faults;
        let of_sensor = |sensor: usize| -> Vec<FaultSpan> {
            faults_of(faults, self.samples[sensor].sensor())
                .copied()
                .collect()
        };
        let find_bias = || self.find_bias(&of_bias, faults, &|| false, run);
        let follow = |sensor: usize| self.follow(sensor, of_sensor(sensor), &|| false);
        let mut passes: Vec<Pass<'_>> = Vec::new();
        if is_bias_faulty() {
            bias.clear();
            passes.push(Box::new(|| bias.set(find_bias())));
        }
        for (sensor, track) in tracks.iter().enumerate().filter(|(s, _)| is_faulty(*s)) {
            let follow = &follow;
            track.clear();
            passes.push(Box::new(move || track.set(follow(sensor))));
        }
        run(passes);
        let bias = bias.take_or(find_bias)?;
        let tracks = tracks.into_iter().enumerate().map(|(sensor, track)| {
            Ok(Track {
                faults: of_sensor(sensor),
                ..track.take_or(|| follow(sensor))?
            })
        });
        let tracks = tracks.collect::<Result<_, _>>()?;
        Ok(Forward {
            found,
            bias,
            tracks,
        })
    }

    fn find_faults(&self, faulty: &[AtomicBool], run: Run<'_>) -> Result<Searched, S::Error> {
        find_faults(self.machine, self.sensors, self.samples, faulty, run)
    }

    /// The sensors that the estimate of the bias depends on.
    fn of_bias(&self) -> Vec<usize> {
        let estimator = BiasEstimator::new(self.machine, self.sensors, false);
        let sensors = 0..self.samples.len();
        sensors
            .filter(|&sensor| estimator.uses(self.samples[sensor].sensor()))
            .collect()
    }

    fn find_bias(
        &self,
        of_bias: &[usize],
        faults: &[FaultSpan],
        is_void: &dyn Fn() -> bool,
        run: Run<'_>,
    ) -> Result<BiasHistory, S::Error> {
        let used = of_bias.iter().map(|&sensor| {
            let samples = &self.samples[sensor];
            (samples, SpanWalk::new(faults_of(faults, samples.sensor())))
        });
        find_bias(self.machine, self.sensors, used.collect(), is_void, run)
    }

    /// Feeds a sensor's samples to its filters, those within its faults treated as the fault requires. Once `is_void`,
    /// the result does not matter.
    fn follow(
        &self,
        sensor: usize,
        faults: Vec<FaultSpan>,
        is_void: &dyn Fn() -> bool,
    ) -> Result<Track, S::Error> {
        let samples = &self.samples[sensor];
        let sensor = samples.sensor();
        let mut chunk = Chunk::default();
        let mut filters = Filters::new(self.machine, self.sensors, false);
        // Known beforehand, unlike to the causal estimator.
        let measures_tilt = measures_tilt(samples, &mut chunk)?;
        filters.has_tilt = measures_tilt;
        let mut counts = StreamCounts::default();
        let mut starts = Vec::with_capacity(self.starts_ns.len());
        let mut walk = SpanWalk::new(faults.iter());
        let mut last_ns = None;
        for k in 0..=samples.len() {
            let sample = samples.sample(k, &mut chunk)?;
            while let Some(start_ns) = self.starts_ns.get(starts.len())
                && sample.is_none_or(|sample| sample.stamp_ns > *start_ns)
            {
                let states = filters.fed_by(sensor).map(|(_, f)| f.state().clone());
                starts.push(Start {
                    sample: k,
                    filters: states.collect(),
                });
            }
            let Some(sample) = sample.filter(|_| !is_void()) else {
                break;
            };
            let is_later = last_ns.replace(sample.stamp_ns) != Some(sample.stamp_ns);
            let judgement = walk.judgement(sample.stamp_ns);
            let taken = match is_later {
                true => filters.push(&sample, &judgement, &[]),
                false => Err(SampleError::NotLater),
            };
            let lacks_a_value = walk.lacks_a_value();
            counts.count(match taken {
                Ok(()) if lacks_a_value => Err(SampleError::NotFinite),
                taken => taken.map(|()| Credible(judgement.is_clean())),
            });
        }
        drop(walk);
        let shown_noise = filters.shown_noise(self.machine, sensor);
        let filters = filters.fed_by(sensor);
        Ok(Track {
            counts,
            faults,
            measures_tilt,
            shown_noise,
            starts,
            last_ns: filters.map(|(f, filter)| (*f, filter.last_ns())).collect(),
        })
    }
}

fn faults_of(faults: &[FaultSpan], sensor: Sensor) -> impl Iterator<Item = &FaultSpan> {
    faults
        .iter()
        .filter(move |span| span.worst.sensor == sensor)
}

/// The result of a pass.
struct Slot<T, E>(Mutex<Option<Result<T, E>>>);

impl<T, E> Default for Slot<T, E> {
    fn default() -> Self {
        Self(Mutex::new(None))
    }
}

impl<T, E> Slot<T, E> {
    fn set(&self, result: Result<T, E>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
    }

    fn clear(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// The result, found here if the pass was not run.
    fn take_or(self, missing: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        let result = self.0.into_inner().unwrap_or_else(PoisonError::into_inner);
        result.unwrap_or_else(missing)
    }
}

/// Whether an orientation of a sensor measures a tilt.
fn measures_tilt<S: SampleSource>(
    samples: &SortedSamples<S>,
    chunk: &mut Chunk,
) -> Result<bool, S::Error> {
    if !matches!(samples.sensor(), Sensor::Imu | Sensor::Odometry) {
        return Ok(false);
    }
    for k in 0..samples.len() {
        let sample = samples.sample(k, chunk)?;
        let orientation = sample.and_then(|sample| sample.values.get(6..));
        if orientation.is_some_and(tilt_is_measured) {
            return Ok(true);
        }
    }
    Ok(false)
}
