//! Rotations of the platform about an edge, from all raw samples of a log.

use std::ops::Range;
use std::sync::Arc;

use anyhow::Result;
use tipwatch_mechanics::estimation::rotation::PlatformRotation;
use tipwatch_mechanics::estimation::visit_by_stamp;

use super::standing_rows::StandingRows;
use crate::base::table::BLOCK_ROWS;
use crate::events::{Event, EventKind, EventPass, RotationTrace, Rotations, Stories};
use crate::load::{LoadedLog, MeasuredLoads, shared_signals};

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

/// Returns the times of the rotations of a log, first and last (ns), from the onset on that the events tell of each: where the loads
/// date it more sharply than gyro and attitude, the machine does not tip before; where they only leave it open until later, it may.
/// Only the rows around the onsets are computed.
pub(super) fn told(
    stories: &Stories<'_>,
    standing: &[StandingRows<'_>],
    measured: &MeasuredLoads,
) -> Vec<[i64; 2]> {
    let Stories {
        table,
        scope,
        rotations,
        ..
    } = *stories;
    let mut passes: Vec<(&StandingRows<'_>, EventPass<'_>)> = Vec::with_capacity(standing.len());
    for it in standing {
        let limits = it.min_loads_n.as_deref();
        let pass = EventPass::new(it.machine, it.rows(), limits, scope, rotations, measured);
        passes.push((it, pass));
    }
    let mut known = 0;
    for rotation in rotations {
        let around = stories.rows_of(rotation);
        let around: Range<usize> = around.start.max(known)..around.end.max(known);
        for (it, pass) in &mut passes {
            pass.skip(&it.rows().reasons[known..around.start]);
        }
        for first in around.clone().step_by(BLOCK_ROWS) {
            let rows = Arc::new(table.window(first..(first + BLOCK_ROWS).min(around.end)));
            for (part, place) in StandingRows::parts_of(&rows, table) {
                for (index, (it, pass)) in passes.iter_mut().enumerate() {
                    match place == Some(index) {
                        true => pass.take(&it.part(&rows, part.clone(), scope)),
                        false => {
                            let others = first + part.start..first + part.end;
                            pass.skip(&it.rows().reasons[others]);
                        }
                    }
                }
            }
        }
        known = around.end;
    }
    let mut by_loads = Vec::new();
    for (it, mut pass) in passes {
        pass.skip(&it.rows().reasons[known..]);
        by_loads.extend(pass.finish().0);
    }
    let events = stories.told(by_loads, table.len());
    let is_of_rotation =
        |event: &&Event| event.kind == EventKind::EdgeTipping && event.measured_rotation.is_some();
    // one of each rotation, in their order
    let tippings = events.iter().filter(is_of_rotation).zip(rotations);
    tippings
        .map(|(tipping, rotation)| {
            let told = (tipping.start_ns, tipping.start_sigma_s);
            let by_rotation = (rotation.start_ns, rotation.start_sigma_s);
            [tips_from_ns(told, by_rotation), rotation.span_ns()[1]]
        })
        .collect()
}

/// Returns the time from which on the machine tips (ns), by those that are told and that the rotation shows, each with its standard
/// deviation (s): what the loads only leave open makes no row valid.
fn tips_from_ns(told: (i64, Option<f64>), by_rotation: (i64, Option<f64>)) -> i64 {
    let is_sharper = match (told.1, by_rotation.1) {
        (Some(told_s), Some(by_rotation_s)) => told_s <= by_rotation_s,
        _ => true,
    };
    match is_sharper {
        true => told.0,
        false => told.0.min(by_rotation.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_tip_later_only_where_the_loads_are_more_certain() {
        let told = |at_ns, sigma_s| tips_from_ns((at_ns, sigma_s), (5, Some(0.05)));
        assert_eq!(told(7, Some(0.02)), 7);
        assert_eq!(told(7, Some(0.3)), 5);
        assert_eq!(told(3, Some(0.3)), 3);
        assert_eq!(tips_from_ns((7, Some(0.3)), (5, None)), 7);
    }
}
