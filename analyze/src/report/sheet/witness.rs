//! Story of an incident, in the order in which a witness would tell it.

use tipwatch_language::{say, word};
use tipwatch_mechanics::{Quantity, State};

use super::answers::{self, condition, doubt, otf_with_band, reserve};
use crate::analysis::Analysis;
use crate::events::{Bound, Event, EventKind, ShownBy};
use crate::page::{capital, with_sure_band};
use crate::report::findings::{Incident, Scene, enumerated, findings};

/// Most wheels that are told to have left the ground after the first ones.
const MOST_LATER: usize = 3;
/// From so long before the onset on a reader is told how long (s): tenths are.
const LEAST_BEFORE_S: f64 = 0.05;
/// For so long a machine has been steady (ns).
const STEADY_NS: i64 = 500_000_000;

/// At most three sentences on the gravest incident, or one on a log without any.
pub(super) fn sentences(analysis: &Analysis, incidents: &[Incident<'_>]) -> Vec<String> {
    let scene = Scene::of(analysis);
    let Some(incident) = incidents.iter().find(|it| it.gravest().is_fact()) else {
        let first = findings(analysis).into_iter().next();
        return first
            .map(|finding| format!("{}.", finding.headline))
            .into_iter()
            .collect();
    };
    let mut told: Vec<String> = before(analysis, &scene, incident, incidents)
        .into_iter()
        .collect();
    told.push(course(&scene, incident));
    told.push(outcome(analysis, &scene, incident));
    told
}

/// The first incident before another that is a fact.
pub(super) fn earlier<'i, 'a>(
    incidents: &'i [Incident<'a>],
    incident: &Incident<'_>,
) -> Option<&'i Incident<'a>> {
    let earlier = incidents
        .iter()
        .filter(|it| it.start_ns() < incident.start_ns());
    let earlier = earlier.filter(|it| it.gravest().is_fact());
    earlier.min_by_key(|it| it.start_ns())
}

/// Describes how the machine was before, and whether it had come close already: in order of time.
fn before(
    analysis: &Analysis,
    scene: &Scene,
    incident: &Incident<'_>,
    incidents: &[Incident<'_>],
) -> Option<String> {
    let earlier = earlier(incidents, incident).map(|it| {
        let event = it.gravest();
        let close = least_load(analysis, scene, event).unwrap_or_else(|| {
            say!(
                "It had come close from {}: {}{}.",
                scene.start(event),
                scene.step(event),
                reserve(scene, event)
            )
        });
        (event.start_ns, close)
    });
    let causes = (incident.with_causes())
        .and_then(|event| Some((event, event.causes.as_ref()?)))
        // what follows a step of the incident was not before it
        .filter(|(_, causes)| causes.since_ns <= incident.start_ns());
    let at_first = causes.map(|(event, causes)| {
        let at_s = scene.seconds(causes.since_ns);
        let is_of_support = matches!(event.kind, EventKind::WheelLight | EventKind::WheelLift);
        let load = is_of_support.then(|| {
            let otf_n = causes.otf_before_n;
            let load_n = otf_with_band(analysis, event, causes.since_ns, otf_n);
            (scene.support(event), load_n)
        });
        let text = match causes.since_is_steady {
            true => {
                let steady = steady(analysis, causes.since_ns);
                let load = load.map_or(String::new(), |(support, load_n)| {
                    say!(", and {support} carried {load_n} N")
                });
                say!("At t = {at_s:.2} s the machine {steady}{load}.")
            }
            false => {
                let load = load.map_or(String::new(), |(support, load_n)| {
                    say!(", when {support} carried {load_n} N")
                });
                let before = match incident.gravest().start_bound {
                    // how long before an onset that may have been earlier is not known
                    Bound::AtOrBefore => String::new(),
                    Bound::At | Bound::AtOrAfter => {
                        before_onset(incident.gravest().start_ns - causes.since_ns)
                    }
                };
                say!("This account begins at t = {at_s:.2} s{before}{load}.")
            }
        };
        (causes.since_ns, text)
    });
    let mut told: Vec<(i64, String)> = earlier.into_iter().chain(at_first).collect();
    told.sort_by_key(|(at_ns, _)| *at_ns);
    let told: Vec<String> = told.into_iter().map(|(_, text)| text).collect();
    (!told.is_empty()).then(|| told.join(" "))
}

/// Describes the time before the onset, unless a reader would see zero.
fn before_onset(before_ns: i64) -> String {
    let before_s = before_ns as f64 * 1e-9;
    match before_s < LEAST_BEFORE_S {
        true => String::new(),
        false => say!(", {before_s:.1} s before the onset"),
    }
}

/// Of a wheel that may or may not have been below its limit, what it carried: that is sure within its band.
fn least_load(analysis: &Analysis, scene: &Scene, event: &Event) -> Option<String> {
    doubt(event.certainty).filter(|_| event.kind == EventKind::WheelLight)?;
    let wheel = analysis.machine.wheel_named(&event.subject)?;
    let row = analysis.rows.at(event.worst_ns);
    let found = analysis.rows.window(row..row + 1);
    let [load_n, sigma_n] =
        [Quantity::Load(wheel), Quantity::LoadSigma(wheel)].map(|of| found.value(of, 0));
    (load_n.is_finite() && sigma_n.is_finite()).then(|| {
        say!(
            "It had come close at t = {:.2} s: {} carried {} N{}.",
            scene.seconds(event.worst_ns),
            scene.support(event),
            with_sure_band(load_n, sigma_n),
            condition(scene, event)
        )
    })
}

/// Describes the motion of a steady machine in the half second before: it moved at a speed that its wheels show beyond their
/// scatter, or it stood. A wheel shows its speed only by its encoder or the odometry: without either its speed is zero in every
/// row.
fn steady(analysis: &Analysis, at_ns: i64) -> String {
    if analysis.coverage.between_rows.is_some() {
        return word!("is taken as steady").into();
    }
    let machine = &analysis.machine;
    let rows = &analysis.rows;
    let (first, last) = (rows.at(at_ns.saturating_sub(STEADY_NS)), rows.at(at_ns));
    let window = rows.window(first..last + 1);
    let mut state = State::zero(machine);
    // of each wheel: sum and sum of squares of its speed; and the sum of the variances by the noise of the signals
    let mut sums = vec![[0.0; 2]; machine.joints().len()];
    let mut noise = 0.0;
    let mut has_odometry = true;
    for row in 0..window.len() {
        window.states.get(row, &mut state);
        has_odometry &= state.base.velocity.iter().all(|part| part.is_finite());
        noise += state.noise.joint.first[0];
        for (sum, joint) in sums.iter_mut().zip(&state.joints) {
            *sum = [sum[0] + joint.rate, sum[1] + joint.rate * joint.rate];
        }
    }
    let count = window.len() as f64;
    let joints = machine.joints().iter().zip(sums);
    let joints = joints.filter(|(joint, _)| joint.logged || has_odometry);
    let speeds = joints.filter_map(|(joint, [sum, squares])| {
        let radius = machine.wheels()[joint.spins_wheel?].radius;
        let mean = sum / count;
        let variance = (squares / count - mean * mean).max(0.0) + noise / count;
        Some([(radius * mean).abs(), 2.0 * radius * variance.sqrt()])
    });
    let known = speeds.filter(|[speed, band]| speed.is_finite() && band.is_finite());
    let fastest = known.max_by(|a, b| (a[0] - a[1]).total_cmp(&(b[0] - b[1])));
    match fastest {
        Some([speed, band]) if speed > band => {
            say!("moved steadily at {speed:.3} ± {:.3} m/s", band.max(0.001))
        }
        Some(_) => word!("stood still").into(),
        None => word!("was steady").into(),
    }
}

/// Describes the course of the incident, step by step.
fn course(scene: &Scene, incident: &Incident<'_>) -> String {
    let steps = [
        EventKind::WheelLight,
        EventKind::WheelLift,
        EventKind::EdgeTipping,
        EventKind::TipOver,
    ];
    // a tip-over is an edge tipping that went on, where that is the first one
    let tipping = incident.first(EventKind::EdgeTipping);
    let went_on = |over: &Event| {
        tipping.is_some_and(|it| it.subject == over.subject && it.start_ns == over.start_ns)
    };
    let steps = steps.into_iter().filter(|kind| match kind {
        EventKind::TipOver => !incident.first(EventKind::TipOver).is_some_and(went_on),
        _ => true,
    });
    let mut events: Vec<&Event> = steps.filter_map(|kind| incident.first(kind)).collect();
    // what leaves the ground later is told, too
    let joined = incident.joined_steps();
    let groups = joined.iter().map(|group| group[0]);
    let lifts = groups.filter(|event| event.kind == EventKind::WheelLift);
    let is_first = |event: &&Event| Some(*event) == incident.first(EventKind::WheelLift);
    events.extend(lifts.filter(|event| !is_first(event)).take(MOST_LATER));
    let with = |event: &Event| -> Vec<&Event> {
        let group = joined.iter().find(|group| group.contains(&event));
        group.cloned().unwrap_or_default()
    };
    // a wheel in the air is below its limit, too: that tells nothing after its lift
    let lift = incident.first(EventKind::WheelLift);
    events.retain(|event| {
        let is_after =
            |lift: &Event| lift.subject == event.subject && lift.start_ns <= event.start_ns;
        event.kind != EventKind::WheelLight || !lift.is_some_and(is_after)
    });
    events.sort_by_key(|event| event.start_ns);
    let mut last = String::new();
    let step = |event: &Event| {
        let start = scene.start(event);
        let subject = scene.subject(event);
        // the same wheel is not named twice
        let wheel = match subject == last {
            true => String::new(),
            false => format!("{} ", scene.support(event)),
        };
        last.clone_from(&subject);
        match event.kind {
            // its condition is that of the lift
            EventKind::WheelLight => match lift {
                Some(_) => say!("{wheel}fell below its load limit at {start}"),
                None => say!(
                    "{wheel}fell below its load limit at {start}{}",
                    reserve(scene, event)
                ),
            },
            EventKind::WheelLift => match scene.subjects_of(&with(event)) {
                names if names.len() > 1 => say!(
                    "{} {} left the ground at {start}{}",
                    scene.word.many,
                    enumerated(&names),
                    reserve(scene, event)
                ),
                _ => say!("{wheel}left the ground at {start}{}", reserve(scene, event)),
            },
            _ => say!(
                "the machine tipped about the {subject} edge from {start}{}",
                reserve(scene, event)
            ),
        }
    };
    let steps: Vec<String> = events.into_iter().map(step).collect();
    let text = match &steps[..] {
        [] => word!("nothing is more likely than not").to_string(),
        [only] => only.clone(),
        [first @ .., last] => say!("{} and {last}", first.join(", ")),
    };
    format!("{}.", capital(&text))
}

/// Describes how the incident ended.
fn outcome(analysis: &Analysis, scene: &Scene, incident: &Incident<'_>) -> String {
    if let Some(event) = incident.first(EventKind::TipOver) {
        return tipped(scene, event, incident);
    }
    if let Some(event) = answers::open_tip_over(incident.events.iter().copied()) {
        return answers::may_have_tipped(scene, event);
    }
    let told = |is_told: fn(EventKind) -> bool| -> Vec<&Event> {
        let facts = incident.events.iter().copied();
        facts
            .filter(|it| it.is_fact() && is_told(it.kind))
            .collect()
    };
    let off = told(|kind| kind != EventKind::WheelLight);
    let is_off = !off.is_empty();
    let told = if is_off { off } else { told(|_| true) };
    let last = told.iter().max_by_key(|it| it.end_ns.unwrap_or(i64::MAX));
    let Some((last, end_ns)) = last.and_then(|last| Some((last, last.end_ns?))) else {
        let is_tipping = incident.first(EventKind::EdgeTipping);
        let is_tipping = is_tipping.is_some_and(|tipping| tipping.end_ns.is_none());
        return match (is_tipping, scene.goes_on) {
            (true, false) => {
                word!("It was still tipping when the log ends; what happened then is not in it.")
            }
            (false, false) => {
                word!("It was still so when the log ends; what happened then is not in it.")
            }
            (_, true) => word!("It was still so at the last row; what happened then is not known."),
        }
        .into();
    };
    let (at, one) = (scene.end(last, end_ns), scene.word.one);
    // what is unknown between the rows follows in the answers
    let scope = match scene.is_sparse {
        true => word!("at the rows of this sparse log").into(),
        false => answers::scope(analysis),
    };
    let no_tip_over = answers::no_tip_over(analysis, &scope);
    // what rows show of the same wheel behind those that are not known
    let later = analysis.events.iter().filter(|event| {
        (event.kind, &event.subject, event.start_bound)
            == (EventKind::WheelLift, &last.subject, Bound::AtOrBefore)
            && event.start_ns > end_ns
            && event.is_fact()
    });
    let later = later.min_by_key(|event| event.start_ns);
    match (last.end_bound, is_off, later) {
        (Bound::AtOrAfter, true, Some(event)) => {
            let until = event.end_ns.map_or(String::new(), |end_ns| {
                say!(", until {}", scene.end(event, end_ns))
            });
            say!(
                "At t = {at} it was still so; the next loads, from t = {:.2} s on, show {} off the ground, again or still{until}. {}.",
                scene.seconds(event.start_ns),
                scene.support(event),
                capital(&no_tip_over)
            )
        }
        (Bound::AtOrAfter, ..) => {
            say!(
                "At t = {at} it was still so; how much longer is not known. {}.",
                capital(&no_tip_over)
            )
        }
        (_, true, _) => say!("At t = {at} every {one} carried load again; {no_tip_over}."),
        (_, false, _) => {
            say!("At t = {at} every {one} carried more than its limit again; {no_tip_over}.")
        }
    }
}

fn tipped(scene: &Scene, event: &Event, incident: &Incident<'_>) -> String {
    let edge = scene.subject(event);
    let by = match event.shown_by {
        Some(ShownBy::Rotation) => word!(", which the computed loads do not show"),
        _ => "",
    };
    let rest = event
        .measured_rotation
        .as_ref()
        .and_then(|it| it.at_rest_ns);
    let rest = rest.map_or(String::new(), |at_ns| {
        say!(
            ", and it lay at rest on its side from t = {:.2} s or earlier",
            scene.seconds(at_ns)
        )
    });
    // those that are told to have lifted are not told again
    let lifts = incident.steps().into_iter();
    let lifts = lifts.filter(|step| step.kind == EventKind::WheelLift);
    let told: Vec<String> = lifts.map(|lift| scene.support(lift)).collect();
    let mut beyond = scene.off_by_stops(event);
    beyond.retain(|wheel| !told.contains(wheel));
    let beyond = match beyond.is_empty() {
        true => String::new(),
        false => say!(
            ", beyond the stop of its axle, so that {} left the ground, too",
            enumerated(&beyond)
        ),
    };
    say!(
        "It tipped over about the {edge} edge, by at least {}{beyond}{by}{rest}.",
        answers::at_least_degrees(event)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::findings::incidents;

    #[test]
    fn no_account_begins_zero_seconds_before_the_onset() {
        assert_eq!(before_onset(49_000_000), "");
        assert!(!before_onset(51_000_000).is_empty());
    }

    #[test]
    fn what_came_before_an_incident_is_the_first_that_is_a_fact() {
        let event = |start_ns: i64, certainty: f64| Event {
            end_ns: Some(start_ns + 1),
            certainty: Some(certainty),
            ..Event::blank(EventKind::WheelLight, start_ns, "fl".into())
        };
        let second = |seconds: i64| seconds * 1_000_000_000;
        let events = [
            event(second(10), 0.1),
            event(second(20), 0.999),
            event(second(30), 0.999),
            Event {
                kind: EventKind::WheelLift,
                ..event(second(40), 0.999)
            },
            event(second(50), 0.999),
        ];
        let found = incidents(&events);
        let gravest = &found[0];
        assert_eq!(gravest.start_ns(), second(40));
        let before = earlier(&found, gravest).map(Incident::start_ns);
        assert_eq!(before, Some(second(20)));
        let first = found.iter().find(|it| it.start_ns() == second(20)).unwrap();
        assert!(earlier(&found, first).is_none());
    }
}
