//! The forward pass: implausible spans, the bias of the accelerometer, and where each block of rows starts.

use std::sync::{Mutex, PoisonError};

use super::sorted_samples::{Chunk, SortedSamples, for_each_by_stamp};
use super::source::SampleSource;
use crate::estimation::bias::{BiasEstimator, BiasHistory};
use crate::estimation::kalman_filter::FilterState;
use crate::estimation::plausibility::{FaultSpan, FaultSpans, Plausibility, SpanWalk};
use crate::estimation::state_builder::{Filters, Followed};
use crate::machine::Machine;
use crate::state::{Credible, SampleError, Sensor, Sensors, StreamCounts, tilt_is_measured};

/// A part of the forward pass, independent of the others.
pub type Pass<'p> = Box<dyn FnOnce() + Send + 'p>;

/// One sensor and its filters over the whole log.
#[derive(Debug)]
pub(super) struct Track {
    pub(super) counts: StreamCounts,
    /// Its implausible spans, sorted by start.
    faults: Vec<FaultSpan>,
    pub(super) measures_tilt: bool,
    /// By block.
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

    /// Whether a filter uses samples after this stamp.
    pub(super) fn goes_on(&self, followed: Followed, after_ns: Option<i64>) -> bool {
        let mut filters = self.last_ns.iter();
        let last = filters.find(|(f, _)| *f == followed);
        last.is_some_and(|(_, last_ns)| *last_ns > after_ns)
    }
}

/// Finds implausible spans, checking all sensors together in stamp order.
pub(super) fn find_faults<S: SampleSource>(
    machine: &Machine,
    sensors: &Sensors,
    samples: &[SortedSamples<S>],
) -> Result<Vec<FaultSpan>, S::Error> {
    let mut plausibility = Plausibility::new(machine, sensors);
    let mut spans = FaultSpans::default();
    for_each_by_stamp(&samples.iter().collect::<Vec<_>>(), |_, sample| {
        // A repeated or backward stamp is counted where the filter refuses it.
        if plausibility.step(sample).is_ok() {
            spans.take(sample.sensor, sample.stamp_ns, plausibility.findings());
        }
    })?;
    Ok(spans.finish())
}

/// Estimates the bias, and follows each sensor to where the blocks start: at the times `starts_ns`. `run` runs all
/// passes.
pub(super) fn follow<S: SampleSource>(
    machine: &Machine,
    sensors: &Sensors,
    samples: &[SortedSamples<S>],
    faults: &[FaultSpan],
    starts_ns: &[i64],
    run: &dyn Fn(Vec<Pass<'_>>),
) -> Result<(BiasHistory, Vec<Track>), S::Error> {
    let bias = Slot::default();
    let tracks: Vec<Slot<Track, S::Error>> = samples.iter().map(|_| Slot::default()).collect();
    let mut passes: Vec<Pass<'_>> = vec![Box::new(|| {
        bias.set(find_bias(machine, sensors, samples, faults));
    })];
    for (samples, slot) in samples.iter().zip(&tracks) {
        passes.push(Box::new(|| {
            slot.set(follow_sensor(machine, sensors, samples, faults, starts_ns));
        }));
    }
    run(passes);
    // What did not run is run now.
    let bias = bias.take_or(|| find_bias(machine, sensors, samples, faults))?;
    let tracks = samples.iter().zip(tracks).map(|(samples, slot)| {
        slot.take_or(|| follow_sensor(machine, sensors, samples, faults, starts_ns))
    });
    Ok((bias, tracks.collect::<Result<_, _>>()?))
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

    fn take_or(self, missing: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        let result = self.0.into_inner().unwrap_or_else(PoisonError::into_inner);
        result.unwrap_or_else(missing)
    }
}

/// Estimates the bias of the accelerometer from all sensors together in stamp order.
fn find_bias<S: SampleSource>(
    machine: &Machine,
    sensors: &Sensors,
    samples: &[SortedSamples<S>],
    faults: &[FaultSpan],
) -> Result<BiasHistory, S::Error> {
    let mut estimator = BiasEstimator::new(machine, sensors, true);
    let used: Vec<&SortedSamples<S>> = (samples.iter())
        .filter(|samples| estimator.uses(samples.sensor()))
        .collect();
    let mut walks: Vec<(SpanWalk<'_>, Option<i64>)> = (used.iter())
        .map(|samples| (SpanWalk::new(faults_of(faults, samples.sensor())), None))
        .collect();
    for_each_by_stamp(&used, |which, sample| {
        let (walk, last_ns) = &mut walks[which];
        if last_ns.replace(sample.stamp_ns) != Some(sample.stamp_ns) {
            estimator.push(sample, &walk.judgement(sample.stamp_ns));
        }
    })?;
    Ok(estimator.smoothed())
}

fn faults_of(faults: &[FaultSpan], sensor: Sensor) -> impl Iterator<Item = &FaultSpan> {
    faults
        .iter()
        .filter(move |span| span.worst.sensor == sensor)
}

/// Feeds a sensor's samples to its filters, those within faults treated as the fault requires.
fn follow_sensor<S: SampleSource>(
    machine: &Machine,
    sensors: &Sensors,
    samples: &SortedSamples<S>,
    faults: &[FaultSpan],
    starts_ns: &[i64],
) -> Result<Track, S::Error> {
    let sensor = samples.sensor();
    let mut chunk = Chunk::default();
    let mut filters = Filters::new(machine, sensors, false);
    // Known beforehand, unlike to the causal estimator.
    filters.has_tilt = measures_tilt(samples, &mut chunk)?;
    let mut track = Track {
        counts: StreamCounts::default(),
        faults: faults_of(faults, sensor).copied().collect(),
        measures_tilt: filters.has_tilt,
        starts: Vec::with_capacity(starts_ns.len()),
        last_ns: Vec::new(),
    };
    let mut walk = SpanWalk::new(track.faults.iter());
    let (mut counts, mut starts, mut last_ns) = (StreamCounts::default(), Vec::new(), None);
    for k in 0..=samples.len() {
        let sample = samples.sample(k, &mut chunk)?;
        while let Some(start_ns) = starts_ns.get(starts.len())
            && sample.is_none_or(|sample| sample.stamp_ns > *start_ns)
        {
            let states = filters.fed_by(sensor).map(|(_, f)| f.state().clone());
            starts.push(Start {
                sample: k,
                filters: states.collect(),
            });
        }
        let Some(sample) = sample else { break };
        let is_later = last_ns.replace(sample.stamp_ns) != Some(sample.stamp_ns);
        let judgement = walk.judgement(sample.stamp_ns);
        let taken = match is_later {
            true => filters.push(&sample, &judgement),
            false => Err(SampleError::NotLater),
        };
        let lacks_a_value = walk.lacks_a_value();
        counts.count(match taken {
            Ok(()) if lacks_a_value => Err(SampleError::NotFinite),
            taken => taken.map(|()| Credible(judgement.is_clean())),
        });
    }
    drop(walk);
    let filters = filters.fed_by(sensor);
    track.last_ns = filters.map(|(f, filter)| (*f, filter.last_ns())).collect();
    (track.counts, track.starts) = (counts, starts);
    Ok(track)
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
