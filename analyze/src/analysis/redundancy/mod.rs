//! Redundant measurements of the arm, compared with its state row by row: forces and lengths of cylinders.
//!
//! The loads do not use these signals. So a contradiction is reported, and rows stay valid: either side may be wrong.

mod compared;
mod forces;
mod lengths;
mod standstill;

use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;

use crate::base::estimated::EstimatedRows;
use crate::events::Event;
use crate::load::LoadedLog;
use crate::load::linkage_force::LinkageForce;

/// Finds the contradictions of other signals with the state of the arm, as events.
pub(crate) fn contradictions(
    log: &Log,
    file: &MachineFile,
    loaded: &LoadedLog,
    forces: &[LinkageForce],
    rows: &EstimatedRows,
) -> Vec<Event> {
    let mut found = forces::contradictions(&loaded.machine, forces, rows);
    found.extend(lengths::contradictions(log, file, loaded, rows));
    found
}
