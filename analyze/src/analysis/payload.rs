//! Masses of payloads from the log: as a signal states them, or estimated from the force of the cylinder that lifts them.

use std::ops::RangeInclusive;

use anyhow::{Context, Result, bail};
use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;
use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::{MOST_MASSES, Machine, MassSignal, Note, PayloadQuantity};
use tipwatch_mechanics::state::{NumberKind, Reason, Sensor};
use tipwatch_mechanics::{ForceQuality, MeasuredForce, State, estimate_payload};

use super::notes::{NotedLog, Notes};
use crate::base::error_text::error_text;
use crate::base::estimated::EstimatedRows;
use crate::base::number::short;
use crate::base::options::Estimator;
use crate::load::LoadedLog;
use crate::load::linkage_force::{LinkageForce, Series, at, series_in};

/// Most rows used for an estimate; more are thinned out evenly.
const MOST_ROWS: usize = 2000;

/// A payload whose mass was estimated.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct EstimatedPayload {
    /// Number of the `[[payload]]` table, from 1.
    pub payload: usize,
    /// Name of the linkage whose force was used.
    pub linkage: String,
    /// Mass (kg).
    pub mass_kg: f64,
    /// Its standard deviation (kg).
    pub sigma_kg: f64,
    /// Friction as a fraction of the force.
    pub friction_share: f64,
    /// Root mean square residual of the fit (N).
    pub residual_n: f64,
    /// Number of samples used.
    pub samples: usize,
}

impl Notes for Vec<EstimatedPayload> {
    fn notes(&self, _: &NotedLog<'_>) -> Vec<Note> {
        let found = self.iter().map(|found| {
            say!(
                "Payload {}: its mass was estimated as {:.0} kg (standard deviation {:.0} kg), from the force of linkage {}.",
                found.payload,
                found.mass_kg,
                found.sigma_kg,
                found.linkage
            )
        });
        found.map(Note::from).collect()
    }
}

/// Gives the rows the masses that signals state, unless the causal estimator has. A row whose sample is missing or too old has
/// none, and so no loads. Returns what the masses were, as sentences.
///
/// # Errors
/// The log lacks a signal.
pub(crate) fn follow_signals(
    log: &Log,
    file: &MachineFile,
    loaded: &LoadedLog,
    rows: &mut EstimatedRows,
    estimator: Estimator,
) -> Result<Vec<String>> {
    let machine = &loaded.machine;
    let mut notes = Vec::new();
    for (payload, spec) in machine.payloads().iter().enumerate() {
        if estimator == Estimator::Causal {
            notes.extend(known_by_row(file, loaded, payload, rows)?);
            continue;
        }
        let Some(mass) = &spec.signal else {
            continue;
        };
        let place = format!("{}: mass.signal", place(file, payload));
        let series = series_in(log, file, loaded, &mass.signal).with_context(|| place)?;
        let is_in = |row: usize| rows.is_in(spec.window_s, row);
        let logged: Vec<f64> = (0..rows.len())
            .map(|row| match is_in(row) {
                true => held(&series, rows.times_ns[row], mass),
                false => 0.0,
            })
            .collect();
        notes.push(as_logged(
            payload,
            mass,
            &logged,
            &machine.possible_payload(),
        ));
        let known = |(row, mass): (usize, f64)| match is_in(row) {
            true => machine.plausible_payload(mass),
            false => mass,
        };
        let masses: Vec<f64> = logged.into_iter().enumerate().map(known).collect();
        for (reasons, mass) in rows.reasons.iter_mut().zip(&masses) {
            if mass.is_nan() {
                reasons.add(Reason::ToolWrenchGap);
            }
        }
        let Some((&first, &last)) = rows.times_ns.first().zip(rows.times_ns.last()) else {
            continue;
        };
        rows.change(machine, &[[first, last]], move |row, state| {
            // what is unknown stays unknown
            let share = &mut state.payload_share[payload];
            *share = *share * 0.0 + masses[row];
        });
    }
    Ok(notes)
}

fn place(file: &MachineFile, payload: usize) -> String {
    format!("{}: payload {}", file.path.display(), payload + 1)
}

/// Describes the causal estimate of a payload's mass by row, in a sentence; `None` for a payload that is not estimated by row.
fn known_by_row(
    file: &MachineFile,
    loaded: &LoadedLog,
    payload: usize,
    rows: &EstimatedRows,
) -> Result<Option<String>> {
    let machine = &loaded.machine;
    let spec = &machine.payloads()[payload];
    if !spec.is_by_row {
        return Ok(None);
    }
    let linkage = spec.lift.as_ref().map(|lift| lift.linkage);
    let mut told_by = machine.payload_signals().iter().enumerate();
    let missing = told_by.find(|(index, signal)| {
        let is_needed = match signal.quantity {
            PayloadQuantity::Mass(of) => of == payload,
            PayloadQuantity::Lift { linkage: of, .. } => Some(of) == linkage,
        };
        let sensor = Sensor::Number(NumberKind::Payload, *index);
        is_needed && !loaded.beside.iter().any(|it| it.sensor == sensor)
    });
    if let Some((_, signal)) = missing {
        bail!(
            "{}: expected a number on topic {}, which tells its mass, found none in the log",
            place(file, payload),
            signal.field.topic
        );
    }
    let mut state = State::zero(machine);
    let (mut least, mut largest, mut unknown) = (f64::INFINITY, f64::NEG_INFINITY, 0);
    for row in (0..rows.len()).filter(|&row| rows.is_in(spec.window_s, row)) {
        rows.state(row, &mut state);
        let mass = state.payload_share[payload];
        unknown += usize::from(mass.is_nan());
        (least, largest) = (least.min(mass), largest.max(mass));
    }
    let seen = match least <= largest {
        true => say!("{} to {} kg", short(least), short(largest)),
        false => word!("known in no row").into(),
    };
    let source = linkage.map_or(word!("as a signal states it").into(), |linkage| {
        say!(
            "estimated from the force of linkage {}",
            file.spec.linkage[linkage].name
        )
    });
    Ok(Some(say!(
        "Mass of payload {}, {source}, by past samples only: {seen}; unknown in {unknown} rows, and with it the loads (reason \
         tool_wrench_gap).",
        payload + 1
    )))
}

/// The last sample before a time, which holds for a time; NaN without one.
fn held((stamps, values): &Series, time_ns: i64, mass: &MassSignal) -> f64 {
    let next = stamps.partition_point(|&stamp| stamp <= time_ns);
    let last = next.checked_sub(1);
    let young = last.filter(|&last| time_ns.saturating_sub(stamps[last]) <= mass.max_age_ns());
    let value = young.map_or(f64::NAN, |last| values[last]);
    if value.is_finite() { value } else { f64::NAN }
}

fn as_logged(
    payload: usize,
    mass: &MassSignal,
    masses: &[f64],
    possible: &RangeInclusive<f64>,
) -> String {
    let known = masses.iter().filter(|mass| mass.is_finite());
    let (least, largest) = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &mass| {
        (a.min(mass), b.max(mass))
    });
    let missing = masses.iter().filter(|mass| mass.is_nan()).count();
    let seen = match least <= largest {
        true => say!("{} to {} kg", short(least), short(largest)),
        false => word!("in no row").into(),
    };
    let missing = match missing {
        0 => String::new(),
        rows => say!(
            "; in {rows} rows its last sample is older than {} s (max_age) or none, and the loads are unknown (reason \
             tool_wrench_gap)",
            short(mass.max_age)
        ),
    };
    let known = masses.iter().filter(|mass| mass.is_finite());
    let impossible = match known.filter(|mass| !possible.contains(mass)).count() {
        0 => String::new(),
        rows => say!(
            "; in {rows} rows it is none, expected {} to {} kg ({} times the machine's mass): an error value or another unit, and \
             the loads are unknown (reason tool_wrench_gap)",
            short(*possible.start()),
            short(*possible.end()),
            short(MOST_MASSES)
        ),
    };
    say!(
        "Mass of payload {} as logged on {}: {seen}{missing}{impossible}.",
        payload + 1,
        mass.signal.topic
    )
}

/// Estimates every payload of unknown mass that is not known row by row, and updates the machine.
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
        let place = place(file, payload);
        let lift = machine.payloads()[payload].lift.as_ref();
        let linkage = lift.map(|lift| lift.linkage).with_context(|| {
            format!("{place}: mass = \"estimate\": expected force or pressure on a [[linkage]] that carries it, or the effort of its rod in [signals.joints], found neither")
        })?;
        if machine.payloads()[payload].is_by_row {
            continue;
        }
        let spec = &file.spec.linkage[linkage];
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
            payload: payload + 1,
            linkage: spec.name.clone(),
            mass_kg: estimate.mass,
            sigma_kg: estimate.sigma,
            friction_share: estimate.friction_share,
            residual_n: estimate.residual,
            samples: estimate.samples,
        });
    }
    Ok(found)
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
