//! Finds the gross inputs of a log.

use anyhow::Result;
use rayon::prelude::*;
use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;

use super::{GrossInput, GrossInputKind};
use super::{actuators, attitude, fields, gyro, joints, odometry, specific_force, stance};
use crate::base::estimated::EstimatedRows;
use crate::events::FoundRotation;
use crate::load::LoadedLog;

/// The gross inputs of a log, each kind once for each signal; none for inputs that are plausible or that cannot
/// be checked. The samples must still be loaded; `rows` need their states only. `rotations` of the platform are those of the
/// whole log.
///
/// # Errors
/// The log cannot be read.
pub(crate) fn gross_inputs(
    log: &Log,
    file: &MachineFile,
    loaded: &LoadedLog,
    rows: &EstimatedRows,
    rotations: &[FoundRotation],
) -> Result<Vec<GrossInput>> {
    // each looks through all samples of a signal
    let checks: [&(dyn Fn() -> Result<Vec<GrossInput>> + Sync); 10] = [
        &|| Ok(Vec::from_iter(specific_force::scale(loaded))),
        &|| Ok(joints::scales(loaded)),
        &|| fields::angles_in_degrees(log, file),
        &|| Ok(attitude::faults(loaded)),
        &|| Ok(Vec::from_iter(attitude::slope_unknown(loaded))),
        &|| Ok(Vec::from_iter(gyro::scale(loaded))),
        &|| Ok(Vec::from_iter(odometry::scale(loaded, rotations))),
        &|| Ok(Vec::from_iter(odometry::exchanged(loaded, rotations))),
        &|| Ok(actuators::scales(loaded)),
        &|| Ok(Vec::from_iter(actuators::support_scale(loaded))),
    ];
    let found = checks.into_par_iter().with_max_len(1).map(|check| check());
    let found: Vec<Vec<GrossInput>> = found.collect::<Result<_>>()?;
    let mut found = found.concat();
    if rotations.iter().any(FoundRotation::is_seen_to_fall) {
        // then it may lie on its side, and the log may begin in the fall
        return Ok(found);
    }
    // what these two say follows from a signal in another unit
    if !(found.iter()).any(|input| input.kind == GrossInputKind::SpecificForceScale) {
        found.extend(stance::direction(&loaded.machine, rows));
    }
    if found.is_empty() {
        found.extend(stance::rests_while_tipping(&loaded.standing(), rows));
    }
    Ok(found)
}
