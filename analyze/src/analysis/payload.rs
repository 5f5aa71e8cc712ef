//! Estimates payload masses from the force of the cylinder that lifts them.

use anyhow::{Context, Result, bail};
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::{LinkageSpec, Machine};
use tipwatch_mechanics::{
    ForceQuality, MeasuredForce, PayloadEstimate, State, carries_payload, estimate_payload,
};

use crate::base::error_text::error_text;
use crate::base::estimated::EstimatedRows;
use crate::load::linkage_force::{LinkageForce, Series, at};

/// Most rows used for an estimate; more are thinned out evenly.
const MOST_ROWS: usize = 2000;

/// A payload whose mass was estimated.
#[derive(Debug, Clone)]
pub struct EstimatedPayload {
    /// Index of the payload.
    pub payload: usize,
    /// Name of the linkage whose force was used.
    pub linkage: String,
    /// The estimate.
    pub estimate: PayloadEstimate,
}

/// Estimates every payload of unknown mass and updates the machine.
///
/// # Errors
/// No linkage that carries the payload has a bound force, or the log lacks the fields.
pub(crate) fn estimate_all(
    file: &MachineFile,
    machine: &mut Machine,
    forces: &[LinkageForce],
    rows: &EstimatedRows,
) -> Result<Vec<EstimatedPayload>> {
    let mut found = Vec::new();
    for payload in 0..machine.payloads().len() {
        if !machine.payloads()[payload].is_estimated {
            continue;
        }
        let place = format!("{}: payload {}", file.path.display(), payload + 1);
        let (linkage, spec) = bound_linkage(file, machine, payload).with_context(|| {
            format!("{place}: mass = \"estimate\": expected force or pressure on a [[linkage]] that carries it, or the effort of its rod in [signals.joints], found neither")
        })?;
        let measured = forces.iter().find(|force| force.linkage == linkage);
        let force = match measured.map(|force| &force.series) {
            Some(Ok(series)) => series,
            Some(Err(error)) => bail!("{}", error_text(error)),
            None => bail!("linkage {}: expected a bound force, found none", spec.name),
        };
        let samples = samples(machine, rows, force);
        let quality = ForceQuality {
            sigma: spec.force_sigma,
            friction_share: spec.friction_share,
            interval_s: interval_s(rows) * thinning(rows) as f64,
        };
        let Some(estimate) = estimate_payload(machine, linkage, payload, &samples, quality) else {
            bail!(
                "{place}: expected valid rows with a force of linkage {}, found none",
                spec.name
            );
        };
        *machine = machine.with_payload_mass(payload, estimate.mass, estimate.sigma);
        found.push(EstimatedPayload {
            payload,
            linkage: spec.name.clone(),
            estimate,
        });
    }
    Ok(found)
}

/// The first linkage with a bound force that carries the payload.
fn bound_linkage<'a>(
    file: &'a MachineFile,
    machine: &Machine,
    payload: usize,
) -> Option<(usize, &'a LinkageSpec)> {
    let linkages = file.spec.linkage.iter().enumerate();
    linkages
        .filter(|(_, spec)| file.spec.force_of(spec).is_some() || spec.pressure.is_some())
        .find(|(linkage, _)| carries_payload(machine, *linkage, payload))
}

/// Valid rows, thinned out, with the measured force interpolated at their time.
fn samples(machine: &Machine, rows: &EstimatedRows, force: &Series) -> Vec<MeasuredForce> {
    let usable = (0..rows.len())
        .step_by(thinning(rows))
        .filter(|&row| rows.is_valid(row));
    usable
        .filter_map(|row| {
            let force = at(force, rows.times_ns[row])?;
            let mut state = State::zero(machine);
            rows.state(row, &mut state);
            Some(MeasuredForce { state, force })
        })
        .collect()
}

fn thinning(rows: &EstimatedRows) -> usize {
    rows.len().div_ceil(MOST_ROWS).max(1)
}

/// Mean time between two rows (s).
fn interval_s(rows: &EstimatedRows) -> f64 {
    rows.seconds(rows.len() - 1) / (rows.len() - 1).max(1) as f64
}
