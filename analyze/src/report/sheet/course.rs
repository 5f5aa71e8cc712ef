//! The time line of an incident: what began when, with its band, how long it lasted, and the time before it.

use maud::{Markup, html};

use crate::analysis::Analysis;
use crate::events::{Event, EventKind};
use crate::report::findings::{Incident, Scene, is_fact};

/// Sizes in the picture's own units.
const WIDTH: f64 = 720.0;
const LABELS: f64 = 210.0;
const LANE: f64 = 20.0;
const RIGHT: f64 = 12.0;
const LETTERS: f64 = 11.0;
/// Most lanes.
const MOST_LANES: usize = 7;

/// One bar.
struct Step {
    label: String,
    class: &'static str,
    from_s: f64,
    to_s: f64,
    band_s: Option<f64>,
    note: String,
}

pub(super) fn figure(analysis: &Analysis, incident: &Incident<'_>) -> Markup {
    let scene = Scene::of(analysis);
    let steps = steps(analysis, &scene, incident);
    let (Some(from), Some(to)) = (
        steps.iter().map(|step| step.from_s).reduce(f64::min),
        steps.iter().map(|step| step.to_s).reduce(f64::max),
    ) else {
        return html! {};
    };
    let span = (to - from).max(0.1);
    let at = |s: f64| LABELS + (s - from) / span * (WIDTH - LABELS - RIGHT);
    let height = LANE * (steps.len() as f64 + 1.0) + 4.0;
    let told: Vec<String> = steps
        .iter()
        .map(|step| format!("{} {}", step.label, step.note))
        .collect();
    let title = "Time line, with bands of two standard deviations";
    html! {
        figure.timeline {
            svg.chart viewBox=(format_args!("0 0 {WIDTH} {height:.0}")) role="img" aria-label=(format_args!("{title}: {}", told.join("; "))) {
                @for (lane, step) in steps.iter().enumerate() {
                    @let top = LANE * lane as f64 + 4.0;
                    @let (left, right) = (at(step.from_s), at(step.to_s).max(at(step.from_s) + 2.0));
                    text x="2" y=(tenth(top + 11.0)) font-size=(LETTERS) text-anchor="start" { (step.label) }
                    rect class=(step.class) x=(tenth(left)) y=(tenth(top + 2.0)) width=(tenth(right - left)) height="11" {}
                    @if let Some(band_s) = step.band_s {
                        @let (low, high) = (at((step.from_s - band_s).max(from)), at((step.from_s + band_s).min(to)));
                        line class="step-band" x1=(tenth(low)) y1=(tenth(top + 7.5)) x2=(tenth(high)) y2=(tenth(top + 7.5)) {}
                    }
                    @let (x, anchor) = note_place(left, right, &step.note);
                    text x=(tenth(x)) y=(tenth(top + 11.0)) font-size=(LETTERS) text-anchor=(anchor) { (step.note) }
                }
                @let floor = LANE * steps.len() as f64 + 4.0;
                line class="axis" x1=(tenth(LABELS)) y1=(tenth(floor)) x2=(tenth(WIDTH - RIGHT)) y2=(tenth(floor)) {}
                @for share in [0.0, 0.5, 1.0] {
                    @let anchor = ["start", "middle", "end"][(2.0 * share) as usize];
                    text x=(tenth(at(from + share * span))) y=(tenth(floor + 13.0)) font-size=(LETTERS) text-anchor=(anchor) {
                        (format_args!("{:.1} s", from + share * span))
                    }
                }
            }
            figcaption { (title) }
        }
    }
}

/// A note stands behind its bar, or before it where there is no room.
fn note_place(left: f64, right: f64, note: &str) -> (f64, &'static str) {
    let width = 5.6 * note.chars().count() as f64;
    if right + 4.0 + width < WIDTH {
        (right + 4.0, "start")
    } else if left - 4.0 - width > LABELS {
        (left - 4.0, "end")
    } else {
        (WIDTH - RIGHT, "end")
    }
}

fn steps(analysis: &Analysis, scene: &Scene, incident: &Incident<'_>) -> Vec<Step> {
    let last_s = analysis.rows.seconds(analysis.rows.len().saturating_sub(1));
    let mut told: Vec<(EventKind, &str)> = Vec::new();
    let mut steps = Vec::new();
    let causes = incident
        .with_causes()
        .and_then(|event| event.causes.as_ref());
    let first_s = scene.seconds(incident.start_ns());
    if let Some(causes) = causes.filter(|causes| causes.since_is_steady) {
        let from_s = (scene.seconds(causes.since_ns) - 0.5).max(0.0);
        steps.push(Step {
            label: "steady".into(),
            class: "step-steady",
            from_s,
            to_s: scene.seconds(causes.since_ns),
            band_s: None,
            note: format!("{:.2} s before", first_s - scene.seconds(causes.since_ns)),
        });
    }
    for event in incident.events.iter().filter(|event| is_fact(event)) {
        let key = (event.kind, event.subject.as_str());
        if told.contains(&key) || steps.len() >= MOST_LANES {
            continue;
        }
        told.push(key);
        let from_s = scene.seconds(event.start_ns);
        let to_s = event.end_ns.map_or(last_s, |end_ns| scene.seconds(end_ns));
        steps.push(Step {
            label: scene.step(event),
            class: class(event),
            from_s,
            to_s: to_s.max(from_s),
            band_s: event.start_sigma_s.map(|sigma_s| 2.0 * sigma_s),
            note: note(scene, event),
        });
    }
    let at_rest = incident
        .events
        .iter()
        .find_map(|event| event.measured_rotation.as_ref()?.at_rest_ns);
    if let Some(at_ns) = at_rest {
        steps.push(Step {
            label: "at rest on its side".into(),
            class: "step-steady",
            from_s: scene.seconds(at_ns),
            to_s: last_s,
            band_s: None,
            note: format!("{:.2} s", scene.seconds(at_ns)),
        });
    }
    steps
}

/// Start, band and lead time.
fn note(scene: &Scene, event: &Event) -> String {
    let start = scene.start(event);
    let start = start.trim_start_matches("t = ");
    match event.lead_s {
        Some(lead_s) => format!("{start}, lead {lead_s:.2} s"),
        None => start.to_owned(),
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
