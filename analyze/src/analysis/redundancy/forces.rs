//! Measured forces of the arm's cylinders against those that masses and motion require, row by row, as
//! [`measured_forces`](tipwatch_mechanics::studies::measured_forces) compares them live, too: the spans of a whole log in which they
//! contradict each other, or in which the measured one stands still.

use rayon::prelude::*;
use tipwatch_mechanics::machine::{ArmForce, Machine};
use tipwatch_mechanics::studies::measured_forces::{
    Compared, MOST_SIGMAS, measured_position, required_force,
};
use tipwatch_mechanics::{Scope, State, Workspace, actuator_force_sigma};

use super::super::measured_loads::sampled_rows;
use super::compared::events;
use super::standstill;
use crate::base::estimated::EstimatedRows;
use crate::events::Event;
use crate::load::linkage_force::{LinkageForce, Series, at};

/// Compared rows for which the same uncertainty of the masses is used.
const SHARED_SIGMA: usize = 25;

/// Finds the contradictions between measured and computed forces, as events that leave rows valid.
pub(super) fn contradictions(
    machine: &Machine,
    forces: &[LinkageForce],
    rows: &EstimatedRows,
) -> Vec<Event> {
    let mut found = Vec::new();
    for force in machine.arm_forces() {
        let measured = forces.iter().find(|it| it.linkage == force.linkage);
        let Some(Ok(series)) = measured.map(|it| &it.series) else {
            continue;
        };
        let compared = compare(machine, force, series, rows);
        let name = machine.linkages()[force.linkage].name.to_lowercase();
        let subject = format!("actuator.{name} against masses and joints");
        found.extend(events(&compared, &subject, "N"));
        let noticed = MOST_SIGMAS * force.force_sigma;
        found.extend(standstill::events(&compared, noticed, &subject, "N"));
    }
    found
}

fn compare(
    machine: &Machine,
    force: &ArmForce,
    series: &Series,
    rows: &EstimatedRows,
) -> Vec<Compared> {
    let mut measured: Vec<(i64, f64, State<f64>)> = Vec::new();
    for row in sampled_rows(rows.len()).filter(|&row| rows.is_valid(row)) {
        let time_ns = rows.times_ns[row];
        if let Some(force) = at(series, time_ns).filter(|force| force.is_finite()) {
            let mut state = State::zero(machine);
            rows.state(row, &mut state);
            measured.push((time_ns, force, state));
        }
    }
    let compared = measured.par_chunks(SHARED_SIGMA).flat_map_iter(|chunk| {
        let middle = &chunk[chunk.len() / 2].2;
        let by_masses = actuator_force_sigma(machine, middle, force.linkage);
        let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
        chunk.iter().filter_map(move |(time_ns, measured, state)| {
            let computed = required_force(machine, state, force.linkage, &mut workspace)?;
            let at = measured_position(machine, state, force.linkage);
            Compared::of_force(*time_ns, force, at, *measured, computed, by_masses)
        })
    });
    compared.collect()
}
