//! The samples of a sensor that the estimator uses: in stamp order, each stamp once, with finite values.

use crate::estimation::smoother::{Chunk, SampleSource, SortedSamples};
use crate::state::{Sample, Sensor};

/// Samples without those that the estimator does not use.
#[derive(Debug)]
pub(super) struct UsableSamples<S> {
    samples: SortedSamples<S>,
    /// Indices of the usable ones; `None` if all are.
    usable: Option<Vec<usize>>,
}

impl<S: SampleSource> UsableSamples<S> {
    /// Reads all samples once.
    pub(super) fn new(samples: SortedSamples<S>) -> Result<Self, S::Error> {
        let mut chunk = Chunk::default();
        let mut usable = Vec::new();
        let mut last_ns = None;
        for k in 0..samples.len() {
            let Some(sample) = samples.sample(k, &mut chunk)? else {
                break;
            };
            if is_finite(&sample) && last_ns != Some(sample.stamp_ns) {
                usable.push(k);
                last_ns = Some(sample.stamp_ns);
            }
        }
        let usable = (usable.len() < samples.len()).then_some(usable);
        Ok(Self { samples, usable })
    }

    pub(super) fn sensor(&self) -> Sensor {
        self.samples.sensor()
    }

    pub(super) fn len(&self) -> usize {
        self.usable.as_ref().map_or(self.samples.len(), Vec::len)
    }

    fn place(&self, k: usize) -> Option<usize> {
        match &self.usable {
            Some(usable) => usable.get(k).copied(),
            None => Some(k),
        }
    }

    /// Stamp of the k-th usable sample.
    pub(super) fn stamp_ns(&self, k: usize) -> Option<i64> {
        self.samples.stamp_ns(self.place(k)?)
    }

    /// Index of the first usable sample after a time.
    pub(super) fn first_after(&self, time_ns: i64) -> usize {
        let first = self.samples.first_after(time_ns);
        match &self.usable {
            Some(usable) => usable.partition_point(|&place| place < first),
            None => first,
        }
    }

    /// The k-th usable sample; `None` past the end.
    pub(super) fn sample<'c>(
        &self,
        k: usize,
        chunk: &'c mut Chunk,
    ) -> Result<Option<Sample<'c>>, S::Error> {
        match self.place(k) {
            Some(place) => self.samples.sample(place, chunk),
            None => Ok(None),
        }
    }
}

/// Whether the values are finite without which the estimator does not use a sample: joint velocities and orientations
/// may be missing.
fn is_finite(sample: &Sample<'_>) -> bool {
    let needed = match sample.sensor {
        Sensor::Joints(_) => sample.values.len() / 2,
        Sensor::Imu | Sensor::Odometry => 6,
        Sensor::ToolWrench => 6,
        Sensor::Number(..) => 1,
    };
    let values = sample.values.get(..needed);
    values.is_some_and(|values| values.iter().all(|value| value.is_finite()))
}
