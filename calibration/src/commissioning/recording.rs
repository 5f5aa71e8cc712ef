//! The samples of a commissioning drive, kept as they came.

use tipwatch_mechanics::state::{Sample, SampleError, Sensor, Sensors};

/// Step of a stamp beyond which a sample counts as damaged, until the next one is near it (ns).
const LARGEST_STEP_NS: i64 = 60_000_000_000;

/// Samples of all sensors.
#[derive(Debug, Clone)]
pub struct Recording {
    series: Vec<Series>,
}

/// Samples of one sensor.
#[derive(Debug, Clone)]
pub(super) struct Series {
    pub(super) sensor: Sensor,
    pub(super) stamps_ns: Vec<i64>,
    /// Values of all samples, one sample after the other.
    values: Vec<f64>,
    width: usize,
    /// Stamp of a sample far from the one before it.
    doubtful_ns: Option<i64>,
}

impl Recording {
    /// An empty recording of these sensors.
    #[must_use]
    pub fn new(sensors: &Sensors) -> Self {
        let series = sensors.iter().filter_map(|sensor| {
            Some(Series {
                sensor,
                stamps_ns: Vec::new(),
                values: Vec::new(),
                width: sensors.value_count(sensor)?,
                doubtful_ns: None,
            })
        });
        Self {
            series: series.collect(),
        }
    }

    /// Takes a sample.
    ///
    /// # Errors
    /// It is of no sensor of the recording, or its stamp does not follow that of the sample before.
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<(), SampleError> {
        let mut all = self.series.iter_mut();
        let series = all.find(|series| series.sensor == sample.sensor);
        let series = series.filter(|series| series.width == sample.values.len());
        series
            .ok_or(SampleError::UnknownSensor)?
            .push(sample.stamp_ns, sample.values)
    }

    /// Whether nothing was recorded.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.series.iter().all(|series| series.stamps_ns.is_empty())
    }

    /// Stamp of the first sample (ns).
    #[must_use]
    pub fn first_ns(&self) -> Option<i64> {
        let first = |series: &Series| series.stamps_ns.first().copied();
        self.series.iter().filter_map(first).min()
    }

    pub(super) fn series(&self) -> &[Series] {
        &self.series
    }
}

impl Series {
    fn push(&mut self, stamp_ns: i64, values: &[f64]) -> Result<(), SampleError> {
        if let Some(&last_ns) = self.stamps_ns.last() {
            let is_far = |from_ns: i64| stamp_ns.abs_diff(from_ns) > LARGEST_STEP_NS.unsigned_abs();
            if is_far(last_ns) && self.doubtful_ns.replace(stamp_ns).is_none_or(is_far) {
                return Err(SampleError::NotLater);
            }
            if stamp_ns <= last_ns {
                return Err(SampleError::NotLater);
            }
        }
        self.doubtful_ns = None;
        self.stamps_ns.push(stamp_ns);
        self.values.extend_from_slice(values);
        Ok(())
    }

    pub(super) fn len(&self) -> usize {
        self.stamps_ns.len()
    }

    pub(super) fn sample(&self, index: usize) -> &[f64] {
        &self.values[index * self.width..(index + 1) * self.width]
    }
}
