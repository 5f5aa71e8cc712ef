//! Measured strokes of cylinders against the angles of the joints that they turn, row by row.
//!
//! Where the machine file binds the position of both in `[signals.joints]`, the state is that by the pivot. The triangle of
//! the linkage gives the stroke at this angle; the measured one must not differ by more than the margin of sliding joints.

use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;
use tipwatch_mechanics::State;
use tipwatch_mechanics::machine::LinkageInput;
use tipwatch_mechanics::studies::measured_forces::Compared;

use super::super::measured_loads::sampled_rows;
use super::compared::events;
use crate::base::estimated::EstimatedRows;
use crate::events::Event;
use crate::load::LoadedLog;
use crate::load::linkage_force::{at, positions_of};

/// Finds the contradictions between measured strokes and angles.
pub(super) fn contradictions(
    log: &Log,
    file: &MachineFile,
    loaded: &LoadedLog,
    rows: &EstimatedRows,
) -> Vec<Event> {
    let machine = &loaded.machine;
    let limit = machine.plausibility().joint_margin_linear;
    let mut found = Vec::new();
    for (linkage, spec) in machine.linkages().iter().zip(&file.spec.linkage) {
        let bound = file.spec.signals.joints.get(&spec.rod);
        let Some(field) = bound.and_then(|fields| fields.position.as_ref()?.field()) else {
            continue;
        };
        if linkage.input != LinkageInput::PivotAngle {
            continue;
        }
        // A log without the field says nothing.
        let Ok(series) = positions_of(log, file, loaded, field) else {
            continue;
        };
        let mut state = State::zero(machine);
        let valid = sampled_rows(rows.len()).filter(|&row| rows.is_valid(row));
        let compared = valid.filter_map(|row| {
            let time_ns = rows.times_ns[row];
            let measured = at(&series, time_ns)?;
            rows.state(row, &mut state);
            let pivot = &state.joints[linkage.measured_joint];
            let stroke = linkage.solve(pivot).rod.displacement;
            Some(Compared {
                time_ns,
                measured,
                computed: stroke,
                limit,
            })
        });
        let compared: Vec<Compared> = compared.collect();
        let subject = format!("joint_states.{} against {}", spec.rod, spec.pivot).to_lowercase();
        found.extend(events(&compared, &subject, "m"));
    }
    found
}
