//! The time line of an incident: what began when, with its band, how long it lasted, and the time before it; or, of a log without
//! an event, when it came closest.

use maud::{Markup, html};
use tipwatch_language::{decimals, say, word};
use tipwatch_mechanics::Quantity;

use super::answers::doubt;
use super::witness::earlier;
use crate::analysis::Analysis;
use crate::events::support_words::SupportWord;
use crate::events::{Event, EventCauses, EventKind};
use crate::page::percent;
use crate::report::findings::{Incident, Scene};

/// Sizes in the picture's own units: narrow, so that its letters can be read on a telephone.
const WIDTH: f64 = 428.0;
const BORDER: f64 = 4.0;
/// A lane: a line of text, and its bar below.
const LANE: f64 = 24.0;
const TEXT: f64 = 10.0;
const BAR: f64 = 7.0;
const LETTERS: f64 = 11.0;
/// Most lanes, of what is missing, and of what is less likely than not.
const MOST_LANES: usize = 7;
const MOST_MISSING: usize = 3;
const MOST_UNLIKELY: usize = 2;
/// An earlier incident is shown up to so long before (s): farther away, nothing else would be seen.
const EARLIER_S: f64 = 30.0;
/// Bars of a lane that are closer than this share of the log are one.
const SEEN_SHARE: f64 = 1.0 / 400.0;

/// A lane.
struct Step {
    label: String,
    class: &'static str,
    /// Start and end of its bars (s).
    spans_s: Vec<[f64; 2]>,
    band_s: Option<f64>,
    note: String,
}

impl Step {
    fn one(label: String, class: &'static str, span_s: [f64; 2], note: String) -> Self {
        Self {
            label,
            class,
            spans_s: vec![span_s],
            band_s: None,
            note,
        }
    }
}

/// The time line of the gravest incident that is a fact; without one, of the log.
pub(super) fn figure(analysis: &Analysis, incidents: &[Incident<'_>]) -> Markup {
    let scene = Scene::of(analysis);
    let incident = incidents.iter().find(|it| it.gravest().is_fact());
    let steps = match incident {
        Some(incident) => steps(analysis, &scene, incident, incidents),
        None => of_log(analysis, &scene, incidents),
    };
    if steps.is_empty() {
        return html! {};
    }
    // of a log without an event all of its time
    let whole_s = incident.is_none().then(|| [0.0, last_s(analysis)]);
    let ends = || steps.iter().flat_map(|step| &step.spans_s).chain(&whole_s);
    let from = ends().map(|span| span[0]).fold(f64::INFINITY, f64::min);
    let to = ends().map(|span| span[1]).fold(f64::NEG_INFINITY, f64::max);
    let span = (to - from).max(0.1);
    let at = |s: f64| BORDER + (s - from) / span * (WIDTH - 2.0 * BORDER);
    let height = LANE * steps.len() as f64 + 18.0;
    let told: Vec<String> = steps
        .iter()
        .map(|step| format!("{} {}", step.label, step.note))
        .collect();
    let title = word!("Time line, with bands of two standard deviations");
    html! {
        figure.timeline {
            svg.chart viewBox=(format_args!("0 0 {WIDTH} {height:.0}")) role="img" aria-label=(format_args!("{title}: {}", told.join("; "))) {
                @for (lane, step) in steps.iter().enumerate() {
                    @let top = LANE * lane as f64;
                    @let middle = top + TEXT + 3.0 + BAR / 2.0;
                    text x=(tenth(BORDER)) y=(tenth(top + TEXT)) font-size=(LETTERS) text-anchor="start" {
                        (step.label) ": " (step.note)
                    }
                    @for &[from_s, to_s] in &step.spans_s {
                        @let (left, right) = (at(from_s), at(to_s).max(at(from_s) + 2.0));
                        rect class=(step.class) x=(tenth(left)) y=(tenth(top + TEXT + 3.0)) width=(tenth(right - left)) height=(tenth(BAR)) {}
                    }
                    @if let Some((band_s, &[from_s, _])) = step.band_s.zip(step.spans_s.first()) {
                        @let (low, high) = (at((from_s - band_s).max(from)), at((from_s + band_s).min(to)));
                        line class="step-band" x1=(tenth(low)) y1=(tenth(middle)) x2=(tenth(high)) y2=(tenth(middle)) {}
                    }
                }
                @let floor = LANE * steps.len() as f64 + 3.0;
                line class="axis" x1=(tenth(at(from))) y1=(tenth(floor)) x2=(tenth(at(from + span))) y2=(tenth(floor)) {}
                @for share in [0.0, 0.5, 1.0] {
                    @let anchor = ["start", "middle", "end"][(2.0 * share) as usize];
                    text x=(tenth(at(from + share * span))) y=(tenth(floor + 12.0)) font-size=(LETTERS) text-anchor=(anchor) {
                        (decimals(format!("{:.1} s", from + share * span)))
                    }
                }
            }
            figcaption { (title) }
        }
    }
}

fn steps(
    analysis: &Analysis,
    scene: &Scene,
    incident: &Incident<'_>,
    incidents: &[Incident<'_>],
) -> Vec<Step> {
    let last_s = last_s(analysis);
    let mut steps = Vec::new();
    let causes = incident
        .with_causes()
        .and_then(|event| event.causes.as_ref());
    let first_s = scene.seconds(incident.start_ns());
    let earlier = earlier(incidents, incident).map(Incident::gravest);
    if let Some(event) = earlier.filter(|it| scene.seconds(it.start_ns) > first_s - EARLIER_S) {
        let label = say!("before: {}", scene.step(event));
        steps.push(of_event(analysis, scene, event, label));
    }
    let is_before =
        |causes: &&EventCauses| causes.since_is_steady && causes.since_ns <= incident.start_ns();
    if let Some(causes) = causes.filter(is_before) {
        let since_s = scene.seconds(causes.since_ns);
        let note = say!(
            "until t = {since_s:.2} s, {:.2} s before the first step",
            first_s - since_s
        );
        let span_s = [(since_s - 0.5).max(0.0), since_s];
        steps.push(Step::one(
            word!("steady").into(),
            "step-steady",
            span_s,
            note,
        ));
    }
    let room = MOST_LANES.saturating_sub(steps.len());
    for group in incident.joined_steps().into_iter().take(room) {
        let label = scene.joined_step(&group);
        steps.push(of_event(analysis, scene, group[0], label));
    }
    let at_rest = incident
        .events
        .iter()
        .find_map(|event| event.measured_rotation.as_ref()?.at_rest_ns);
    if let Some(at_ns) = at_rest {
        let at_s = scene.seconds(at_ns);
        steps.push(Step::one(
            word!("at rest on its side").into(),
            "step-steady",
            [at_s, last_s],
            say!("from t = {at_s:.2} s or earlier"),
        ));
    }
    steps
}

fn last_s(analysis: &Analysis) -> f64 {
    let last = analysis.rows.len().saturating_sub(1);
    analysis.rows.seconds(last)
}

fn of_event(analysis: &Analysis, scene: &Scene, event: &Event, label: String) -> Step {
    let from_s = scene.seconds(event.start_ns);
    let to_s = event
        .end_ns
        .map_or(last_s(analysis), |end_ns| scene.seconds(end_ns));
    let span_s = [from_s, to_s.max(from_s)];
    Step {
        band_s: event.start_sigma_s.map(|sigma_s| 2.0 * sigma_s),
        ..Step::one(label, class(event), span_s, note(scene, event))
    }
}

/// The lanes of a log without an event that is a fact: all of it, when it came closest, what may have been, and what is missing.
/// None where nothing is known of its loads.
fn of_log(analysis: &Analysis, scene: &Scene, incidents: &[Incident<'_>]) -> Vec<Step> {
    let Some((row, wheel)) = analysis.digest.lightest else {
        return Vec::new();
    };
    let note = match (incidents.is_empty(), scene.is_sparse) {
        _ if analysis.turning.is_some() => word!("it ends while the platform turns"),
        (false, _) => word!("nothing is more likely than not"),
        (true, true) => word!("no event at its rows"),
        (true, false) if analysis.coverage.is_whole() => word!("no event as computed"),
        (true, false) => word!("no event where its loads are known"),
    };
    let whole = Step {
        spans_s: known_s(analysis),
        ..Step::one(
            word!("log").into(),
            "step-steady",
            [0.0; 2],
            note.to_string(),
        )
    };
    let found = analysis.rows.window(row..row + 1);
    let load_n = found.value(Quantity::Load(wheel), 0);
    let at_s = analysis.rows.seconds(row);
    let closest = Step::one(
        word!("closest").into(),
        "step-light",
        [at_s; 2],
        say!(
            "{} at {} of its load at rest, t = {at_s:.2} s",
            SupportWord::named(&analysis.machine.wheels()[wheel]),
            percent(load_n / analysis.machine.reference().static_load[wheel])
        ),
    );
    let unlikely = incidents.iter().take(MOST_UNLIKELY).map(|incident| {
        let event = incident.gravest();
        let mut step = of_event(analysis, scene, event, scene.step(event));
        step.note += &doubt(event.certainty).map_or(String::new(), |doubt| format!(" ({doubt})"));
        step
    });
    [whole, closest]
        .into_iter()
        .chain(unlikely)
        .chain(missing(analysis, scene))
        .collect()
}

/// Times with known loads (s).
fn known_s(analysis: &Analysis) -> Vec<[f64; 2]> {
    let rows = &analysis.rows;
    let known = rows.reasons.iter().enumerate();
    let known = known.filter(|(_, reasons)| reasons.leave_loads());
    let times = known.map(|(row, _)| [rows.seconds(row); 2]);
    // between the rows of a sparse log its motion is bounded
    let near_s = match analysis.coverage.between_rows {
        Some(_) => f64::INFINITY,
        None => analysis.machine.longest_known_gap_ns() as f64 * 1e-9,
    };
    joined(times, near_s.max(SEEN_SHARE * last_s(analysis)))
}

/// Spans of time in order of their start, those together that are at most so far apart (s).
fn joined(spans_s: impl Iterator<Item = [f64; 2]>, near_s: f64) -> Vec<[f64; 2]> {
    let mut all: Vec<[f64; 2]> = Vec::new();
    for [from_s, to_s] in spans_s {
        match all.last_mut() {
            Some(last) if from_s - last[1] <= near_s => last[1] = last[1].max(to_s),
            _ => all.push([from_s, to_s]),
        }
    }
    all
}

/// Signals with gaps, and times between rows in which a lift is not excluded.
fn missing(analysis: &Analysis, scene: &Scene) -> Vec<Step> {
    let mut lanes: Vec<(String, Vec<[f64; 2]>)> = Vec::new();
    for event in &analysis.events {
        let label = match event.kind {
            EventKind::InputGap => say!("without data: {}", scene.subject(event)),
            EventKind::LiftNotExcluded => word!("lift not excluded between rows").into(),
            _ => continue,
        };
        let to_s = event
            .end_ns
            .map_or(last_s(analysis), |end_ns| scene.seconds(end_ns));
        let span_s = [scene.seconds(event.start_ns), to_s];
        match lanes.iter_mut().find(|(known, _)| *known == label) {
            Some((_, spans_s)) => spans_s.push(span_s),
            None => lanes.push((label, vec![span_s])),
        }
    }
    let near_s = SEEN_SHARE * last_s(analysis);
    let lanes = lanes.into_iter().take(MOST_MISSING);
    lanes
        .map(|(label, mut spans_s)| {
            spans_s.sort_by(|a, b| a[0].total_cmp(&b[0]));
            let note = match &spans_s[..] {
                &[[from_s, to_s]] => say!("t = {from_s:.2} to {to_s:.2} s"),
                all => say!("{} times", all.len()),
            };
            Step {
                spans_s: joined(spans_s.into_iter(), near_s),
                ..Step::one(label, "step-gap", [0.0; 2], note)
            }
        })
        .collect()
}

/// Start, band and lead time.
fn note(scene: &Scene, event: &Event) -> String {
    let start = scene.start(event);
    match scene.lead(event) {
        Some((lead_s, from)) => {
            say!("from {start}, lead time {lead_s:.2} s ({from} light)")
        }
        None => say!("from {start}"),
    }
}

fn class(event: &Event) -> &'static str {
    match event.kind {
        EventKind::WheelLight => "step-light",
        EventKind::WheelLift => "step-lift",
        _ => "step-tip",
    }
}

fn tenth(value: f64) -> String {
    format!("{value:.1}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_that_nobody_could_tell_apart_are_one() {
        let spans_s = [[0.0, 1.0], [1.01, 1.5], [1.2, 1.3], [2.0, 2.0], [9.0, 9.0]];
        let joined = joined(spans_s.into_iter(), 0.1);
        assert_eq!(joined, [[0.0, 1.5], [2.0, 2.0], [9.0, 9.0]]);
    }
}
