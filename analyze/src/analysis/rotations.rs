//! Rotations of the platform about an edge, from all raw samples of a log.

use anyhow::Result;
use tipwatch_mechanics::estimation::rotation::PlatformRotation;
use tipwatch_mechanics::estimation::visit_by_stamp;

use crate::base::options::Options;
use crate::events::{FoundRotation, RotationTrace};
use crate::load::{LoadedLog, shared_signals};

/// Finds them in the requested time range, counted from the first row. Neither rows nor their validity matter.
///
/// # Errors
/// Samples cannot be read from their temporary file.
pub(super) fn find(
    loaded: &LoadedLog,
    first_row_ns: Option<i64>,
    options: &Options,
) -> Result<Vec<FoundRotation>> {
    let sensors = &loaded.matched.sensors;
    let mut watch = PlatformRotation::new(&loaded.machine, sensors);
    let mut trace = RotationTrace::default();
    let at = |seconds: f64| {
        let first_ns = first_row_ns.unwrap_or(0);
        first_ns.saturating_add((seconds * 1e9).round() as i64)
    };
    let until_ns = options.to_s.map_or(i64::MAX, at);
    visit_by_stamp(sensors, shared_signals(loaded), &mut |sample| {
        if sample.stamp_ns <= until_ns {
            watch.step(sample);
            trace.take(&watch, sample.stamp_ns);
        }
    })?;
    let mut found = trace.finish(&watch);
    if let Some(from_ns) = options.from_s.map(at) {
        found.retain(|rotation| rotation.end_ns.is_none_or(|end_ns| end_ns >= from_ns));
    }
    Ok(found)
}
