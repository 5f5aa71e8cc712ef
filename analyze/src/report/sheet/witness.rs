//! What happened, in the order in which a witness would tell it.

use tipwatch_language::{say, word};

use super::answers::{self, capital, reserve};
use crate::analysis::Analysis;
use crate::events::{Event, EventKind, ShownBy};
use crate::page::number;
use crate::report::findings::{Incident, Scene, findings};

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
    let mut told: Vec<String> = before(&scene, incident, incidents).into_iter().collect();
    told.push(course(&scene, incident));
    told.push(outcome(analysis, &scene, incident));
    told
}

/// How the machine was before, and whether it had come close already.
fn before(scene: &Scene, incident: &Incident<'_>, incidents: &[Incident<'_>]) -> Option<String> {
    let earlier = incidents
        .iter()
        .filter(|it| it.start_ns() < incident.start_ns());
    let earlier = earlier.filter(|it| it.gravest().is_fact());
    let earlier = earlier.min_by_key(|it| it.start_ns()).map(|it| {
        let event = it.gravest();
        let at_s = scene.seconds(event.start_ns);
        say!(
            "At t = {at_s:.2} s it had come close ({}). ",
            scene.step(event)
        )
    });
    let earlier = earlier.unwrap_or_default();
    let event = incident.with_causes()?;
    let causes = event.causes.as_ref()?;
    let at_s = scene.seconds(causes.since_ns);
    let load = match event.kind {
        EventKind::WheelLight | EventKind::WheelLift => say!(
            ", and {} carried {} N",
            scene.support(event),
            number(causes.otf_before_n)
        ),
        _ => String::new(),
    };
    Some(match causes.since_is_steady {
        true => say!("{earlier}At t = {at_s:.2} s the machine was steady{load}."),
        false => say!(
            "{earlier}The machine moved throughout; what follows counts from t = {at_s:.2} s{load}."
        ),
    })
}

/// What happened then, step by step.
fn course(scene: &Scene, incident: &Incident<'_>) -> String {
    let steps = [
        EventKind::WheelLight,
        EventKind::WheelLift,
        EventKind::EdgeTipping,
        EventKind::TipOver,
    ];
    // a tip-over is an edge tipping that went on
    let steps = steps.into_iter().filter(|kind| match kind {
        EventKind::TipOver => incident.first(EventKind::EdgeTipping).is_none(),
        _ => true,
    });
    let mut events: Vec<&Event> = steps.filter_map(|kind| incident.first(kind)).collect();
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
            EventKind::WheelLift => {
                say!("{wheel}left the ground at {start}{}", reserve(scene, event))
            }
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

/// How it ended.
fn outcome(analysis: &Analysis, scene: &Scene, incident: &Incident<'_>) -> String {
    if let Some(event) = incident.first(EventKind::TipOver) {
        return tipped(scene, event);
    }
    let mut ends = incident.events.iter().map(|event| event.end_ns);
    let end_ns = ends.try_fold(i64::MIN, |last, end| Some(last.max(end?)));
    match (incident.first(EventKind::EdgeTipping), end_ns) {
        (Some(tipping), None) if tipping.end_ns.is_none() => {
            word!("It was still tipping when the log ends; what happened then is not in it.").into()
        }
        (_, None) => {
            word!("It was still so when the log ends; what happened then is not in it.").into()
        }
        (_, Some(end_ns)) => say!(
            "At t = {:.2} s every {} carried load again; no tip-over {}.",
            scene.seconds(end_ns),
            scene.word.one,
            answers::scope(analysis)
        ),
    }
}

fn tipped(scene: &Scene, event: &Event) -> String {
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
    say!(
        "It tipped over about the {edge} edge, by at least {}{by}{rest}.",
        answers::at_least_degrees(event)
    )
}
