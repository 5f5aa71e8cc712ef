//! The bias of the accelerometer over a whole log.
//!
//! A batch of samples is put in stamp order and judged, then taken by the estimator. Two batches are on this way at the
//! same time, so that two threads share the work.

use std::ops::Range;

use super::pass::{Run, by_turns};
use super::sorted_samples::{ByStamp, SortedSamples};
use super::source::SampleSource;
use crate::estimation::bias::{BiasEstimator, BiasHistory};
use crate::estimation::plausibility::{Judgement, SpanWalk};
use crate::machine::Machine;
use crate::state::{Sample, Sensor, Sensors};

/// Samples of a batch.
const BATCH: usize = 2048;

/// Estimates the bias from these sensors together in stamp order, the samples of each treated as its faults require. Once
/// `is_void`, the result does not matter. `run` runs the parts of the work.
pub(super) fn find_bias<S: SampleSource>(
    machine: &Machine,
    sensors: &Sensors,
    used: Vec<(&SortedSamples<S>, SpanWalk<'_>)>,
    is_void: &dyn Fn() -> bool,
    run: Run<'_>,
) -> Result<BiasHistory, S::Error> {
    let mut estimator = BiasEstimator::new(machine, sensors, true);
    let (samples, walks): (Vec<_>, Vec<_>) = used.into_iter().unzip();
    let mut judged = JudgedSamples {
        samples: ByStamp::new(samples),
        walks: walks.into_iter().map(|walk| (walk, None)).collect(),
    };
    by_turns(
        run,
        |batch: &mut Batch| judged.fill(batch),
        |batch| batch.give_to(&mut estimator),
        |batches| is_void() || batches.iter().all(|batch| batch.samples.is_empty()),
    )?;
    Ok(estimator.smoothed())
}

/// Consecutive samples, and how they are to be treated.
#[derive(Default)]
struct Batch {
    samples: Vec<Judged>,
    values: Vec<f64>,
}

/// A sample of a batch.
struct Judged {
    sensor: Sensor,
    stamp_ns: i64,
    values: Range<usize>,
    judgement: Judgement,
}

impl Batch {
    fn give_to(&self, estimator: &mut BiasEstimator) {
        for judged in &self.samples {
            let sample = Sample::new(
                judged.sensor,
                judged.stamp_ns,
                &self.values[judged.values.clone()],
            );
            estimator.push(&sample, &judged.judgement);
        }
    }
}

/// Samples in stamp order, and how they are to be treated.
struct JudgedSamples<'s, S> {
    samples: ByStamp<'s, S>,
    /// Faults of each sensor, and the stamp of its last sample.
    walks: Vec<(SpanWalk<'s>, Option<i64>)>,
}

impl<S: SampleSource> JudgedSamples<'_, S> {
    /// Replaces a batch by the next samples; none after the last. Of equal stamps of a sensor only the first is used.
    fn fill(&mut self, batch: &mut Batch) -> Result<(), S::Error> {
        batch.samples.clear();
        batch.values.clear();
        while batch.samples.len() < BATCH
            && let Some((which, sample)) = self.samples.next()?
        {
            let (walk, last_ns) = &mut self.walks[which];
            if last_ns.replace(sample.stamp_ns) == Some(sample.stamp_ns) {
                continue;
            }
            let first = batch.values.len();
            batch.values.extend_from_slice(sample.values);
            batch.samples.push(Judged {
                sensor: sample.sensor,
                stamp_ns: sample.stamp_ns,
                values: first..batch.values.len(),
                judgement: walk.judgement(sample.stamp_ns),
            });
        }
        Ok(())
    }
}
