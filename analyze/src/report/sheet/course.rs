//! The time line of an incident: what began when, with its band, how long it lasted, and the time before it.

use maud::{Markup, html};
use tipwatch_language::{decimals, say, word};

use crate::analysis::Analysis;
use crate::events::{Event, EventCauses, EventKind};
use crate::report::findings::{Incident, Scene};

/// Sizes in the picture's own units: narrow, so that its letters can be read on a telephone.
const WIDTH: f64 = 428.0;
const BORDER: f64 = 4.0;
/// A lane: a line of text, and its bar below.
const LANE: f64 = 24.0;
const TEXT: f64 = 10.0;
const BAR: f64 = 7.0;
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
                    @let (left, right) = (at(step.from_s), at(step.to_s).max(at(step.from_s) + 2.0));
                    @let middle = top + TEXT + 3.0 + BAR / 2.0;
                    text x=(tenth(BORDER)) y=(tenth(top + TEXT)) font-size=(LETTERS) text-anchor="start" {
                        (step.label) ": " (step.note)
                    }
                    rect class=(step.class) x=(tenth(left)) y=(tenth(top + TEXT + 3.0)) width=(tenth(right - left)) height=(tenth(BAR)) {}
                    @if let Some(band_s) = step.band_s {
                        @let (low, high) = (at((step.from_s - band_s).max(from)), at((step.from_s + band_s).min(to)));
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

fn steps(analysis: &Analysis, scene: &Scene, incident: &Incident<'_>) -> Vec<Step> {
    let last_s = analysis.rows.seconds(analysis.rows.len().saturating_sub(1));
    let mut steps = Vec::new();
    let causes = incident
        .with_causes()
        .and_then(|event| event.causes.as_ref());
    let first_s = scene.seconds(incident.start_ns());
    let is_before =
        |causes: &&EventCauses| causes.since_is_steady && causes.since_ns <= incident.start_ns();
    if let Some(causes) = causes.filter(is_before) {
        let from_s = (scene.seconds(causes.since_ns) - 0.5).max(0.0);
        steps.push(Step {
            label: word!("steady").into(),
            class: "step-steady",
            from_s,
            to_s: scene.seconds(causes.since_ns),
            band_s: None,
            note: say!(
                "until t = {:.2} s, {:.2} s before the first step",
                scene.seconds(causes.since_ns),
                first_s - scene.seconds(causes.since_ns)
            ),
        });
    }
    let room = MOST_LANES.saturating_sub(steps.len());
    for group in incident.joined_steps().into_iter().take(room) {
        let event = group[0];
        let from_s = scene.seconds(event.start_ns);
        let to_s = event.end_ns.map_or(last_s, |end_ns| scene.seconds(end_ns));
        steps.push(Step {
            label: scene.joined_step(&group),
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
            label: word!("at rest on its side").into(),
            class: "step-steady",
            from_s: scene.seconds(at_ns),
            to_s: last_s,
            band_s: None,
            note: say!("from t = {:.2} s or earlier", scene.seconds(at_ns)),
        });
    }
    steps
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
