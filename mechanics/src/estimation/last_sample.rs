//! A number that is held, not filtered: no state follows from it.

use crate::state::{Sample, SampleError, Sensor};

/// The last sample of a number: its stamp (ns) and value.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LastSample(Option<(i64, f64)>);

impl LastSample {
    /// Takes a sample. A command may be that nothing is asked for.
    ///
    /// # Errors
    /// It is not later than the one before, not finite, or has not one value.
    pub(super) fn take(&mut self, sample: &Sample<'_>) -> Result<(), SampleError> {
        let &[value] = sample.values else {
            return Err(SampleError::UnknownSensor);
        };
        if self
            .0
            .is_some_and(|(last_ns, _)| sample.stamp_ns <= last_ns)
        {
            return Err(SampleError::NotLater);
        }
        self.0 = Some((sample.stamp_ns, value));
        let asks_nothing = matches!(sample.sensor, Sensor::Command(_)) && value.is_nan();
        match value.is_finite() || asks_nothing {
            true => Ok(()),
            false => Err(SampleError::NotFinite),
        }
    }

    /// Its finite value, if it is of about this time; else NaN.
    pub(super) fn near(self, time_ns: i64, max_gap_ns: i64) -> f64 {
        let is_near = |(stamp_ns, value): &(i64, f64)| {
            time_ns.abs_diff(*stamp_ns) <= max_gap_ns.unsigned_abs() && value.is_finite()
        };
        self.0.filter(is_near).map_or(f64::NAN, |(_, value)| value)
    }
}
