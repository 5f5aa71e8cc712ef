//! Where the smoother reads samples from.

use std::convert::Infallible;
use std::ops::Range;

use crate::state::Sensor;

/// All samples of one sensor, wherever they are kept.
pub trait SampleSource: Sync {
    /// Error of reading samples.
    type Error: Send;

    /// The sensor.
    fn sensor(&self) -> Sensor;

    /// Stamps of all samples (ns), in any order.
    fn stamps_ns(&self) -> &[i64];

    /// Reads the samples with these indices, in the order of the stamps, into `values`: the values of one sample after
    /// another, see [`Sample`](crate::state::Sample), all of the same number.
    ///
    /// # Errors
    /// The samples cannot be read.
    fn read(&self, samples: Range<usize>, values: &mut [f64]) -> Result<(), Self::Error>;
}

/// All samples of one sensor, in memory.
#[derive(Debug, Clone, Copy)]
pub struct SensorSamples<'a> {
    /// The sensor.
    pub sensor: Sensor,
    /// Stamps (ns), in any order.
    pub stamps_ns: &'a [i64],
    /// Values of all samples, one sample after another: see [`Sample`](crate::state::Sample). Missing ones are unknown.
    pub values: &'a [f64],
}

impl SampleSource for SensorSamples<'_> {
    type Error = Infallible;

    fn sensor(&self) -> Sensor {
        self.sensor
    }

    fn stamps_ns(&self) -> &[i64] {
        self.stamps_ns
    }

    fn read(&self, samples: Range<usize>, values: &mut [f64]) -> Result<(), Infallible> {
        let width = values.len() / samples.len().max(1);
        let known = self.values.get(samples.start * width..).unwrap_or_default();
        let count = known.len().min(values.len());
        values[..count].copy_from_slice(&known[..count]);
        values[count..].fill(f64::NAN);
        Ok(())
    }
}
