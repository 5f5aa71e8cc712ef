//! The first lines of the report: did it tip over, which wheels left the ground, how sure, under which
//! assumptions, when.

use maud::Markup;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::{Ground, Split};

use super::findings::{Scene, rank};
use super::when::Calendar;
use crate::analysis::Analysis;
use crate::analysis::imu_check::FAULT;
use crate::events::{Event, EventKind, ShownBy, TIP_OVER_RAD};
use crate::page::{facts, number, probability};

/// Question and answer, five of them, in the order of their importance.
pub(crate) fn conclusion(analysis: &Analysis) -> [(&'static str, String); 5] {
    [
        ("Did it tip over?", tipped_over(analysis)),
        ("Which wheels left the ground?", lifted(analysis)),
        ("How sure is this?", certainty(analysis)),
        ("Under which assumptions?", assumptions(analysis)),
        ("When was it?", when(analysis)),
    ]
}

pub(super) fn section(analysis: &Analysis) -> Markup {
    facts(&conclusion(analysis))
}

/// Why nothing is known of the machine's stability; `None` if something is.
fn nothing_known(analysis: &Analysis) -> Option<String> {
    if let Some(gross) = analysis.gross_inputs.first() {
        return Some(format!("Unknown: {}", gross.headline));
    }
    let is_nothing = !(0..analysis.rows.len()).any(|row| analysis.rows.reasons[row].leave_loads());
    is_nothing.then(|| "Unknown: wheel loads cannot be computed in any row.".into())
}

/// "in this log", or in the part of its time that is known.
fn scope(analysis: &Analysis) -> String {
    let coverage = &analysis.coverage;
    match (coverage.lift_not_excluded_s(), coverage.between_rows) {
        (Some(seconds), _) => {
            return format!(
                "at the rows of this sparse log ({coverage} with known wheel loads); between them a lift, and what may follow from it, cannot be excluded for {seconds:.1} s"
            );
        }
        (None, Some(_)) if coverage.is_whole() => {
            return "in this sparse log, given the stated greatest rates and accelerations between its rows".into();
        }
        _ => {}
    }
    match coverage.is_whole() {
        true if analysis.losses.end_is_lost() => format!(
            "was found up to t = {:.2} s; the end of the log is lost, and what happened afterwards is not known",
            analysis.rows.seconds(analysis.rows.len() - 1)
        ),
        true => "in this log".into(),
        false => format!(
            "in the {coverage} of the log with known wheel loads; nothing is known of the rest"
        ),
    }
}

fn of_kind(analysis: &Analysis, kind: EventKind) -> impl Iterator<Item = &Event> {
    analysis
        .events
        .iter()
        .filter(move |event| event.kind == kind)
}

fn tipped_over(analysis: &Analysis) -> String {
    let scene = Scene::of(analysis);
    let at = |event: &Event| format!("from t = {:.2} s", scene.seconds(event.start_ns));
    // what is measured directly holds whatever is wrong with the loads
    if let Some(event) = of_kind(analysis, EventKind::TipOver).next()
        && (event.measured_rotation.is_some() || nothing_known(analysis).is_none())
    {
        let (edge, at) = (scene.subject(event), at(event));
        let tilt = event.worst.to_degrees();
        let unseen = match event.shown_by {
            Some(ShownBy::Rotation) => " The computed loads do not show it.",
            _ => "",
        };
        return format!("Yes, about the {edge} edge, {at}: its tilt grew by {tilt:.1}°.{unseen}");
    }
    if let Some(unknown) = nothing_known(analysis) {
        return unknown;
    }
    let scope = scope(analysis);
    let mut tipping: Vec<&Event> = of_kind(analysis, EventKind::EdgeTipping).collect();
    tipping.sort_by_key(|event| event.end_ns.is_some());
    match tipping.first() {
        Some(event) if event.end_ns.is_none() => format!(
            "Not known: it was tipping about the {} edge {} when the log ends, and no tilt of {:.0}° about that edge was seen.",
            scene.subject(event),
            at(event),
            TIP_OVER_RAD.to_degrees()
        ),
        Some(event) => format!(
            "No tip-over {scope}. But it was tipping about the {} edge {}.",
            scene.subject(event),
            at(event)
        ),
        None => format!("No tip-over {scope}."),
    }
}

fn lifted(analysis: &Analysis) -> String {
    if nothing_known(analysis).is_some() {
        return "Unknown.".into();
    }
    let scene = Scene::of(analysis);
    let mut events: Vec<&Event> = of_kind(analysis, EventKind::WheelLift).collect();
    events.sort_by_key(|event| (event.start_ns, rank(event.kind)));
    let mut wheels: Vec<(String, f64, usize, bool)> = Vec::new();
    for event in events {
        let name = scene.subject(event);
        let depends = event.split_dependent != Some(false);
        match wheels.iter_mut().find(|wheel| wheel.0 == name) {
            Some(wheel) => (wheel.2, wheel.3) = (wheel.2 + 1, wheel.3 && depends),
            None => wheels.push((name, scene.seconds(event.start_ns), 1, depends)),
        }
    }
    let text = |(name, start, times, _): &(String, f64, usize, bool)| match times {
        1 => format!("{name} (from t = {start:.2} s)"),
        times => format!("{name} ({times} times, first from t = {start:.2} s)"),
    };
    let of = |depends: bool| -> Vec<String> {
        wheels
            .iter()
            .filter(|wheel| wheel.3 == depends)
            .map(text)
            .collect()
    };
    let (sure, by_rule) = (of(false), of(true));
    let mut sentences = Vec::new();
    if !sure.is_empty() {
        sentences.push(format!(
            "Under any load split that equilibrium allows: {}.",
            sure.join(", ")
        ));
    }
    if !by_rule.is_empty() {
        sentences.push(format!(
            "Under the stated load split, but not under every one that equilibrium allows: {}.",
            by_rule.join(", ")
        ));
    }
    if wheels.is_empty() {
        sentences.push(format!(
            "None under the stated load split {}.",
            scope(analysis)
        ));
    }
    sentences.extend(could_have_lifted(analysis, &wheels));
    sentences.join(" ")
}

/// Other wheels that carry no load under some split.
fn could_have_lifted(analysis: &Analysis, lifted: &[(String, f64, usize, bool)]) -> Option<String> {
    let names: Vec<&str> = (analysis.machine.wheels().iter().enumerate())
        .filter(|(wheel, facts)| {
            let could_unload = analysis.digest.wheels[*wheel].could_unload;
            could_unload && !lifted.iter().any(|known| known.0 == facts.name)
        })
        .map(|(_, facts)| facts.name.as_str())
        .collect();
    match names.is_empty() {
        true if lifted.is_empty() => Some(
            "No split that equilibrium allows unloads a wheel, tolerances of the inputs aside."
                .into(),
        ),
        true => None,
        false => Some(format!(
            "Another split that equilibrium allows would leave {} without load at some time; {} would decide.",
            names.join(", "),
            what_would_decide(analysis)
        )),
    }
}

/// What would tell the split: not what the log has already.
fn what_would_decide(analysis: &Analysis) -> &'static str {
    let forces = &analysis.machine.contact().actuated_joints;
    let measures_loads =
        !analysis.measured_loads.is_empty() || forces.iter().any(|force| force.linkage().is_none());
    match (measures_loads, forces.is_empty()) {
        (true, _) => "more exact measured loads or known flat ground",
        (false, true) => "weighing, cylinder pressures or known flat ground",
        (false, false) => "weighing or known flat ground",
    }
}

fn certainty(analysis: &Analysis) -> String {
    let scene = Scene::of(analysis);
    let mut sentences = Vec::new();
    let mut events: Vec<&Event> = (analysis.events.iter())
        .filter(|event| event.kind.is_observed())
        .collect();
    events.sort_by_key(|event| (rank(event.kind), event.start_ns));
    match events.first() {
        Some(event) => {
            let what = format!(
                "{} {}",
                crate::page::readable(event.kind.name()),
                scene.subject(event)
            );
            sentences.push(match event.certainty {
                Some(certainty) => format!(
                    "Confidence in \"{what}\": {}, from the stated uncertainties, under the stated load split and the assumptions below; under any split: {}.",
                    probability(certainty),
                    (event.certainty_any_split).map_or("not known".into(), probability)
                ),
                None => format!("No confidence could be computed for \"{what}\"."),
            });
        }
        None => sentences
            .extend((analysis.digest.lightest).map(|(row, wheel)| smallest(analysis, row, wheel))),
    }
    if !analysis.coverage.is_whole() {
        sentences.push(format!(
            "Wheel loads are known in {} of the log.",
            analysis.coverage
        ));
    }
    let faults = analysis.notes.iter().filter(|note| note.starts_with(FAULT));
    let faults = faults.count();
    if faults > 0 {
        sentences.push(
            "An input contradicts the machine file (see Limitations): do not rely on this.".into(),
        );
    }
    sentences.join(" ")
}

/// The load of a wheel at a row, with its band.
fn smallest(analysis: &Analysis, row: usize, wheel: usize) -> String {
    let found = analysis.rows.window(row..row + 1);
    let load = number(found.value(Quantity::Load(wheel), 0));
    let name = &analysis.machine.wheels()[wheel].name;
    let sigma = Some(found.value(Quantity::LoadSigma(wheel), 0));
    let band = match sigma.filter(|sigma| sigma.is_finite()) {
        Some(sigma) => format!("± {} N (two standard deviations)", number(2.0 * sigma)),
        None => "N, of unknown uncertainty".into(),
    };
    format!(
        "The smallest load compared with that at rest was {load} {band} on wheel {name}, given the assumptions below."
    )
}

fn assumptions(analysis: &Analysis) -> String {
    let contact = analysis.machine.contact();
    let split = match &contact.split {
        Split::RollMomentDistribution { share, .. } => format!(
            "the front axle takes {:.0} % of the load difference between the sides",
            100.0 * share
        ),
        Split::Springs => "the wheels are springs under a rigid frame".into(),
    };
    let ground = match contact.ground {
        Ground::Unknown => {
            "the wheels' points of contact lie where the model puts them (the shape of the ground is unknown)"
        }
        Ground::Plane => "the ground is flat, as the machine file states",
    };
    format!(
        "Masses and geometry as stated in machine file and URDF; load split: {split}; {ground}; rigid frame and arm."
    )
}

fn when(analysis: &Analysis) -> String {
    let scene = Scene::of(analysis);
    let calendar = Calendar::of(analysis);
    let times = &analysis.rows.times_ns;
    let (Some(first), Some(last)) = (
        times.first().and_then(|&t| calendar.utc(t)),
        times.last().and_then(|&t| calendar.utc(t)),
    ) else {
        return format!("Unknown: {}.", calendar.source());
    };
    let mut events: Vec<&Event> = (analysis.events.iter())
        .filter(|event| event.kind.is_observed())
        .collect();
    events.sort_by_key(|event| (rank(event.kind), event.start_ns));
    let event = events.first().and_then(|event| {
        let mut what = crate::page::readable(event.kind.name());
        what[..1].make_ascii_uppercase();
        let start = calendar.utc(event.start_ns)?;
        Some(format!("{what} {} at {start}. ", scene.subject(event)))
    });
    format!(
        "{}Rows from {first} to {last}, {}.",
        event.unwrap_or_default(),
        calendar.source()
    )
}
