//! The study: rows, equations, all explanations, their probabilities.

use tipwatch_language::word;
use tipwatch_mechanics::estimation::plausibility::LeanOnTyres;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::number::SURE_SIGMAS;

use super::amounts::{Scene, Unstated};
use super::equations::{Equations, Part};
use super::explanations::{Fitted, Problem, Trial, Wanted, trials};
use super::fall::Fall;
use super::load_estimates::estimates;
use super::nuisances::Nuisances;
use super::result::{EstimatedAmount, ExplainedFall, Explanation};
use super::rows::{FallRows, Reader};
use crate::base::table::Table;
use crate::events::{Event, EventKind};

/// Most rotations of a log that are explained, the largest first.
const MOST_FALLS: usize = 5;
/// Least rotation that is explained (rad): tyres allow less on their own.
const LEAST_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// Fewest rows of onset and fall.
const FEWEST_ROWS: usize = 4;
/// Fewest rows of the lean.
const FEWEST_LEAN_ROWS: usize = 6;
/// Least load of a tyre, as a share of the mean load, for which the platform leans in proportion.
const LEAST_LOAD: f64 = 0.08;

/// The rotations about edges among the events.
pub(crate) fn falls(table: &Table, events: &[Event]) -> Vec<Fall> {
    let rotation = |event: &Event| event.rotation_rad.unwrap_or(0.0);
    let mut tippings: Vec<&Event> = (events.iter())
        .filter(|event| event.kind == EventKind::EdgeTipping && rotation(event) >= LEAST_RAD)
        .filter(|event| event.other_edge().is_none())
        .collect();
    tippings.sort_by(|a, b| rotation(b).total_cmp(&rotation(a)));
    // a tipping that went on to a tip-over is as unseen as that
    let is_shown = |event: &Event| {
        let begins = |it: &&Event| it.subject == event.subject && it.start_ns == event.start_ns;
        !events.iter().filter(begins).any(Event::hides_onset)
    };
    let fall = |event: &&Event| {
        let machine = table.machine_at(table.at(event.start_ns))?;
        let edge = machine.edge_named(&event.subject)?;
        // what explains a fall about the line to a pivot is not tried
        let is_its_line = machine
            .axles_astride(&machine.polygon().edges()[edge])
            .next()
            .is_none();
        is_its_line.then(|| Fall {
            edge,
            onset_ns: event.start_ns,
            onset_in_log: is_shown(event),
            onset_sigma_s: event.start_sigma_s,
            until_ns: event.end_ns.unwrap_or(i64::MAX),
        })
    };
    let all: Vec<Fall> = tippings.iter().filter_map(fall).collect();
    stood_before(&all).into_iter().take(MOST_FALLS).collect()
}

/// Selects the falls that began on all wheels, in the same order, each as long as the machine rotates about no other edge. A fall
/// that began while the machine rotated about another edge is the consequence of that rotation, however much farther it went;
/// where the first one is not known, the larger one counts, which comes first.
fn stood_before(all: &[Fall]) -> Vec<Fall> {
    let leads = |one: &Fall, other: &Fall| {
        let lead_s = other.onset_ns.saturating_sub(one.onset_ns) as f64 * 1e-9;
        lead_s > SURE_SIGMAS * one.onset_sigma_s().hypot(other.onset_sigma_s())
    };
    let overlap =
        |one: &Fall, other: &Fall| one.onset_ns <= other.until_ns && other.onset_ns <= one.until_ns;
    let stood = |&(place, fall): &(usize, &Fall)| {
        let others = all.iter().enumerate().filter(|(of, _)| *of != place);
        let mut others = others.filter(|(_, other)| overlap(other, fall));
        !others.any(|(of, other)| leads(other, fall) || (of < place && !leads(fall, other)))
    };
    let alone = |(_, fall): (usize, &Fall)| {
        let later = all.iter().filter(|other| leads(fall, other));
        let until_ns = later.map(|other| other.onset_ns).min();
        Fall {
            until_ns: fall.until_ns.min(until_ns.unwrap_or(i64::MAX)),
            ..*fall
        }
    };
    all.iter().enumerate().filter(stood).map(alone).collect()
}

/// Explains each fall.
pub(crate) fn study(table: &Table, falls: &[Fall]) -> Vec<ExplainedFall> {
    let machine = |fall: &Fall| table.machine_at(table.at(fall.onset_ns));
    let known = falls.iter().filter_map(|fall| Some((machine(fall)?, fall)));
    known
        .map(|(machine, fall)| of_fall(machine, table, *fall))
        .collect()
}

fn of_fall(machine: &Machine, table: &Table, fall: Fall) -> ExplainedFall {
    let blank = ExplainedFall {
        edge: machine.polygon().edges()[fall.edge].name.clone(),
        onset_ns: fall.onset_ns,
        until_ns: fall.onset_ns,
        rotation_rad: 0.0,
        rows: 0,
        lean_rows: 0,
        explanations: Vec::new(),
        load: None,
        not_estimated: None,
    };
    match explained(machine, table, fall, &blank) {
        Ok(explained) => explained,
        Err(why) => ExplainedFall {
            not_estimated: Some(why),
            ..blank
        },
    }
}

fn explained(
    machine: &Machine,
    table: &Table,
    fall: Fall,
    blank: &ExplainedFall,
) -> Result<ExplainedFall, String> {
    if !fall.onset_in_log {
        return Err(word!("the log does not contain the onset").into());
    }
    let mut reader =
        Reader::new(machine, table, fall).ok_or(word!("the state at the onset is unknown"))?;
    let rows = reader.rows();
    if rows.onset.len() + rows.fall.len() < FEWEST_ROWS {
        return Err(word!("too few rows of the rotation can be computed").into());
    }
    let used = rows.fall.iter().map(|row| row.rotation_rad);
    if used.fold(0.0, f64::max) < LEAST_RAD {
        return Err(word!("the rotation has hardly begun in the rows that can be computed").into());
    }
    let scene = Scene {
        machine,
        edge: fall.edge,
        load: machine.load_on_tool(),
        lean: LeanOnTyres::of(machine),
    };
    let (rows, no_lean) = with_lean(&scene, rows, fall);
    let has_attitude = rows.has_attitude;
    let equations = Equations::new(&scene, rows, no_lean.is_none());
    let nuisances = Nuisances::of(&scene, &equations, fall, has_attitude);
    let problem = Problem {
        equations: &equations,
        nuisances: &nuisances,
    };
    let trials = trials(&scene, &equations, fall.onset_ns, table.proven());
    let fitted: Vec<Option<Fitted>> = trials
        .iter()
        .map(|trial| {
            let fitted = trial.fit(&scene, &problem)?;
            fitted.is_possible(trial, &scene).then_some(fitted)
        })
        .collect();
    let explanations = judged(&trials, &fitted);
    if explanations.is_empty() {
        return Err(word!("the moments about the edge cannot be computed").into());
    }
    let of_load = trials.iter().position(|trial| trial.kind == "load_on_tool");
    let load = of_load.and_then(|place| {
        let link = machine.links()[scene.load?.tool].name.clone();
        let fitted = fitted[place].as_ref()?;
        Some(estimates(link, &equations, fitted, no_lean, machine.mass()))
    });
    let last = equations.rows.iter().max_by_key(|row| row.time_ns);
    Ok(ExplainedFall {
        until_ns: last.map_or(fall.onset_ns, |row| row.time_ns),
        rotation_rad: last.map_or(0.0, |row| row.rotation_rad),
        rows: equations.count(Part::Onset) + equations.count(Part::Fall),
        lean_rows: equations.count(Part::Lean),
        explanations,
        load,
        ..blank.clone()
    })
}

/// Leaves of the rows before the lift those in which every tyre is a loaded spring, with a load as the fall weighs it and
/// without; or says why there are none.
fn with_lean(scene: &Scene<'_>, mut rows: FallRows, fall: Fall) -> (FallRows, Option<String>) {
    let lean = std::mem::take(&mut rows.lean);
    if scene.lean.is_none() {
        let why = word!(
            "the lean is known only for an IMU on the platform and wheels without a suspension"
        );
        return (rows, Some(why.into()));
    }
    if let Some(why) = rows.no_lean.clone() {
        return (rows, Some(why));
    }
    let moments = FallRows {
        onset: rows.onset.clone(),
        fall: rows.fall.clone(),
        lean: Vec::new(),
        no_lean: None,
        has_attitude: rows.has_attitude,
    };
    let equations = Equations::new(scene, moments, false);
    let nuisances = Nuisances::of(scene, &equations, fall, rows.has_attitude);
    let problem = Problem {
        equations: &equations,
        nuisances: &nuisances,
    };
    let fitted = (scene.load).and_then(|_| Trial::load(scene.machine).fit(scene, &problem));
    let mass = fitted.map_or(0.0, |fitted| fitted.posterior.mean[0]);
    let [without, with] =
        [0.0, mass].map(|mass| scene.computed(&lean, &[(Unstated::LoadMass, mass)]));
    let is_loaded = |row: usize| {
        [&without, &with]
            .iter()
            .all(|of| of[row].least_load >= LEAST_LOAD)
    };
    let until = (0..lean.len()).take_while(|&row| is_loaded(row)).count();
    rows.lean = lean;
    rows.lean.truncate(until);
    let why = (until < FEWEST_LEAN_ROWS).then(|| {
        rows.lean.clear();
        word!("a wheel was off the ground, or nearly so, in too many rows before the lift")
            .to_string()
    });
    (rows, why)
}

/// The explanations with their probabilities, every kind equally probable beforehand, the most probable first.
fn judged(trials: &[Trial], fitted: &[Option<Fitted>]) -> Vec<Explanation> {
    let of_kind = |kind: &str| trials.iter().filter(|trial| trial.kind == kind).count() as f64;
    let known = || {
        trials
            .iter()
            .zip(fitted)
            .filter_map(|(t, f)| Some((t, f.as_ref()?)))
    };
    let score =
        |trial: &Trial, fitted: &Fitted| fitted.posterior.log_evidence - of_kind(trial.kind).ln();
    let scores = known().map(|(trial, fitted)| score(trial, fitted));
    let Some(largest) = scores.reduce(f64::max) else {
        return Vec::new();
    };
    let total: f64 = known().map(|(t, f)| (score(t, f) - largest).exp()).sum();
    let stated = fitted.first().and_then(Option::as_ref);
    let stated = stated.map_or(f64::NAN, |fitted| fitted.posterior.log_evidence);
    let explanation = |(trial, fitted): (&Trial, &Fitted)| Explanation {
        kind: trial.kind,
        subject: trial.subject.clone(),
        probability: (score(trial, fitted) - largest).exp() / total,
        log_evidence: fitted.posterior.log_evidence - stated,
        amounts: amounts(trial, fitted),
    };
    let mut all: Vec<Explanation> = known().map(explanation).collect();
    all.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    all
}

fn amounts(trial: &Trial, fitted: &Fitted) -> Vec<EstimatedAmount> {
    let Fitted { posterior, .. } = fitted;
    let of = |(place, wanted): (usize, &Wanted)| EstimatedAmount {
        name: wanted.name,
        value: posterior.mean[place],
        sigma: posterior.covariance[(place, place)].max(0.0).sqrt(),
        unit: wanted.unit,
    };
    trial.fitted.iter().enumerate().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fall(edge: usize, from_s: f64, until_s: f64) -> Fall {
        Fall {
            edge,
            onset_ns: (from_s * 1e9) as i64,
            onset_in_log: true,
            onset_sigma_s: Some(0.05),
            until_ns: (until_s * 1e9) as i64,
        }
    }

    /// Returns the edges and ends (s) of the explained falls, the largest first.
    fn explained(all: &[Fall]) -> Vec<(usize, f64)> {
        let found = stood_before(all);
        let of = |fall: &Fall| (fall.edge, fall.until_ns as f64 * 1e-9);
        found.iter().map(of).collect()
    }

    #[test]
    fn the_edge_that_the_platform_left_is_explained_not_the_one_it_ended_on() {
        let far = fall(1, 2.0, 9.0);
        assert_eq!(explained(&[far, fall(0, 1.0, 5.0)]), [(0, 2.0)]);
        // which was first is not known: the larger one
        assert_eq!(explained(&[far, fall(0, 1.95, 5.0)]), [(1, 9.0)]);
        // it had come back before
        assert_eq!(explained(&[far, fall(0, 1.0, 1.5)]), [(1, 9.0), (0, 1.5)]);
        // a smaller one on the way
        assert_eq!(explained(&[far, fall(0, 3.0, 5.0)]), [(1, 3.0)]);
    }
}
