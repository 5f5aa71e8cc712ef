//! Measured forces of the arm's cylinders against those that masses and motion require, row by row.
//!
//! ```text
//!     r = F_measured - F_computed
//!     s^2 = s_sample^2 + s_friction^2 + s_masses^2
//! ```
//! with the standard deviations of a sample and of the friction from the linkage in the machine file, and that of masses,
//! centres of mass and payloads ([`actuator_force_sigma`]). A span in which |r| exceeds 5 s for two seconds on end is
//! reported: the force, a position of the arm, a mass, or a load on the arm that nothing measures is wrong; or the cylinder is
//! at its stop, or the arm rests on something. So is one in which the measured force repeats bit for bit although the
//! computed one changes by more than 5 s_sample.

use rayon::prelude::*;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::{LinkageSpec, Machine, Payload};
use tipwatch_mechanics::{
    Scope, State, Workspace, actuator_force, actuator_force_sigma, carries_payload, evaluate_one,
};

use super::super::measured_loads::sampled_rows;
use super::compared::{Compared, events};
use super::standstill;
use crate::base::estimated::EstimatedRows;
use crate::events::Event;
use crate::load::linkage_force::{LinkageForce, Series, at};

/// Standard deviations from which measured and computed force contradict each other.
const MOST_SIGMAS: f64 = 5.0;
/// Compared rows for which the same uncertainty of the masses is used.
const SHARED_SIGMA: usize = 25;

/// Finds the contradictions between measured and computed forces, as events that leave rows valid.
pub(super) fn contradictions(
    file: &MachineFile,
    machine: &Machine,
    forces: &[LinkageForce],
    rows: &EstimatedRows,
) -> Vec<Event> {
    let mut found = Vec::new();
    for force in forces {
        let (spec, linkage) = (&file.spec.linkage[force.linkage], force.linkage);
        let Ok(series) = &force.series else { continue };
        if !is_redundant(machine, linkage) {
            continue;
        }
        let compared = compare(machine, linkage, spec, series, rows);
        let subject = format!(
            "actuator.{} against masses and joints",
            spec.name.to_lowercase()
        );
        found.extend(events(&compared, &subject, "N"));
        let noticed = MOST_SIGMAS * spec.force_sigma;
        found.extend(standstill::events(&compared, noticed, &subject, "N"));
    }
    found
}

/// Whether no result rests on the force: it neither splits the load of wheels nor determines the mass of a payload.
fn is_redundant(machine: &Machine, linkage: usize) -> bool {
    let pivot = machine.linkages()[linkage].bodies.pivot;
    let carries_wheel =
        (machine.wheels().iter()).any(|wheel| machine.is_carried_by(wheel.body, pivot));
    let tells_mass = |(payload, spec): (usize, &Payload)| {
        let weighs = (spec.lift.as_ref()).is_some_and(|lift| lift.linkage == linkage);
        spec.is_estimated && (weighs || carries_payload(machine, linkage, payload))
    };
    !carries_wheel && !machine.payloads().iter().enumerate().any(tells_mass)
}

fn compare(
    machine: &Machine,
    linkage: usize,
    spec: &LinkageSpec,
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
        let by_masses = actuator_force_sigma(machine, middle, linkage);
        let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
        chunk.iter().map(move |(time_ns, force, state)| {
            evaluate_one(machine, state, &mut workspace);
            let computed = actuator_force(machine, state, &workspace, linkage);
            let friction = spec.friction_share * force.abs().max(computed.abs());
            Compared {
                time_ns: *time_ns,
                measured: *force,
                computed,
                limit: MOST_SIGMAS * spec.force_sigma.hypot(friction).hypot(by_masses),
            }
        })
    });
    compared.collect()
}
