//! Rotations of the platform about an edge, from all raw samples of a log.

use anyhow::Result;
use tipwatch_mechanics::estimation::rotation::PlatformRotation;
use tipwatch_mechanics::estimation::visit_by_stamp;

use crate::events::{RotationTrace, Rotations};
use crate::load::{LoadedLog, shared_signals};

/// Finds them in the samples up to a time. Neither rows nor their validity matter.
///
/// # Errors
/// Samples cannot be read from their temporary file.
pub(super) fn until(loaded: &LoadedLog, until_ns: i64) -> Result<Rotations> {
    let sensors = &loaded.matched.sensors;
    let mut watch = PlatformRotation::new(&loaded.machine, sensors);
    let mut trace = RotationTrace::default();
    visit_by_stamp(sensors, shared_signals(loaded), &mut |sample| {
        if sample.stamp_ns <= until_ns {
            watch.step(sample);
            trace.take(&watch, sample.stamp_ns);
        }
    })?;
    Ok(trace.finish(&watch))
}
