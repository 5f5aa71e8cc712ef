//! The samples of a source in stamp order.

use super::source::SampleSource;
use crate::state::{Sample, Sensor, Sensors};

/// Number of samples read at a time.
const CHUNK: usize = 256;

/// A source whose samples are visited in stamp order.
#[derive(Debug)]
pub(in crate::estimation) struct SortedSamples<S> {
    source: S,
    /// Number of values in a sample.
    width: usize,
    /// Index of each sample by time; `None` where they are in order.
    order: Option<Vec<usize>>,
}

/// Consecutive samples read from a source.
#[derive(Debug, Clone, Default)]
pub(in crate::estimation) struct Chunk {
    values: Vec<f64>,
    first: usize,
    count: usize,
}

impl<S: SampleSource> SortedSamples<S> {
    /// `None` where there is no such sensor.
    pub(in crate::estimation) fn new(source: S, sensors: &Sensors) -> Option<Self> {
        let stamps_ns = source.stamps_ns();
        let order = (!stamps_ns.is_sorted()).then(|| {
            let mut order: Vec<usize> = (0..stamps_ns.len()).collect();
            order.sort_by_key(|&i| stamps_ns[i]);
            order
        });
        Some(Self {
            width: sensors.value_count(source.sensor())?,
            source,
            order,
        })
    }

    pub(in crate::estimation) fn sensor(&self) -> Sensor {
        self.source.sensor()
    }

    pub(in crate::estimation) fn len(&self) -> usize {
        self.source.stamps_ns().len()
    }

    /// Stamp of the k-th sample by time.
    pub(in crate::estimation) fn stamp_ns(&self, k: usize) -> Option<i64> {
        let stamps_ns = self.source.stamps_ns();
        match &self.order {
            Some(order) => order.get(k).map(|&i| stamps_ns[i]),
            None => stamps_ns.get(k).copied(),
        }
    }

    /// Index of the first sample after a time.
    pub(in crate::estimation) fn first_after(&self, time_ns: i64) -> usize {
        let stamps_ns = self.source.stamps_ns();
        match &self.order {
            Some(order) => order.partition_point(|&i| stamps_ns[i] <= time_ns),
            None => stamps_ns.partition_point(|&stamp| stamp <= time_ns),
        }
    }

    /// The stamps by time, each once.
    pub(in crate::estimation) fn distinct_stamps_ns(&self) -> impl Iterator<Item = i64> {
        let mut last = None;
        (0..self.len())
            .map_while(|k| self.stamp_ns(k))
            .filter(move |&stamp| last.replace(stamp) != Some(stamp))
    }

    /// The k-th sample by time, from `chunk`, which is read anew where it does not hold the sample; `None` past the end.
    ///
    /// Inlined: a sample returned through memory is read again before it is written, and the processor waits for that.
    #[inline(always)]
    pub(in crate::estimation) fn sample<'c>(
        &self,
        k: usize,
        chunk: &'c mut Chunk,
    ) -> Result<Option<Sample<'c>>, S::Error> {
        let Some(stamp_ns) = self.stamp_ns(k) else {
            return Ok(None);
        };
        if !(chunk.first..chunk.first + chunk.count).contains(&k) {
            self.read(k, chunk)?;
        }
        let from = (k - chunk.first) * self.width;
        Ok(Some(Sample::new(
            self.sensor(),
            stamp_ns,
            &chunk.values[from..from + self.width],
        )))
    }

    fn read(&self, first: usize, chunk: &mut Chunk) -> Result<(), S::Error> {
        let count = CHUNK.min(self.len() - first);
        chunk.count = 0;
        chunk.values.resize(count * self.width, f64::NAN);
        match &self.order {
            None => self.source.read(first..first + count, &mut chunk.values)?,
            Some(order) => {
                let order = &order[first..first + count];
                let mut done = 0;
                for run in order.chunk_by(|a, b| a + 1 == *b) {
                    let end = done + run.len();
                    let values = &mut chunk.values[done * self.width..end * self.width];
                    self.source.read(run[0]..run[0] + run.len(), values)?;
                    done = end;
                }
            }
        }
        (chunk.first, chunk.count) = (first, count);
        Ok(())
    }
}

/// The samples of several sensors in stamp order.
pub(in crate::estimation) struct ByStamp<'s, S> {
    sensors: Vec<&'s SortedSamples<S>>,
    chunks: Vec<Chunk>,
    /// Next sample of each sensor, and its stamp (ns).
    next: Vec<(usize, Option<i64>)>,
}

impl<'s, S: SampleSource> ByStamp<'s, S> {
    pub(in crate::estimation) fn new(sensors: Vec<&'s SortedSamples<S>>) -> Self {
        Self {
            chunks: vec![Chunk::default(); sensors.len()],
            next: (sensors.iter())
                .map(|sensor| (0, sensor.stamp_ns(0)))
                .collect(),
            sensors,
        }
    }

    /// The next sample, with the index of its sensor; `None` after the last. Inlined as [`SortedSamples::sample`].
    #[inline(always)]
    pub(in crate::estimation) fn next(&mut self) -> Result<Option<(usize, Sample<'_>)>, S::Error> {
        let stamps = self.next.iter().enumerate();
        let stamps = stamps.filter_map(|(which, (_, stamp))| Some((which, (*stamp)?)));
        let Some((which, _)) = stamps.min_by_key(|(_, stamp)| *stamp) else {
            return Ok(None);
        };
        let (sensor, (sample, _)) = (self.sensors[which], self.next[which]);
        self.next[which] = (sample + 1, sensor.stamp_ns(sample + 1));
        let sample = sensor.sample(sample, &mut self.chunks[which])?;
        Ok(sample.map(|sample| (which, sample)))
    }
}

/// Visits the samples of several sensors in stamp order. Sources of sensors that are not there are left out.
///
/// # Errors
/// Samples cannot be read.
pub fn visit_by_stamp<S: SampleSource>(
    sensors: &Sensors,
    sources: Vec<S>,
    visit: &mut dyn FnMut(&Sample<'_>),
) -> Result<(), S::Error> {
    let sources = sources.into_iter();
    let sorted: Vec<_> = sources
        .filter_map(|source| SortedSamples::new(source, sensors))
        .collect();
    let mut samples = ByStamp::new(sorted.iter().collect());
    while let Some((_, sample)) = samples.next()? {
        visit(&sample);
    }
    Ok(())
}
