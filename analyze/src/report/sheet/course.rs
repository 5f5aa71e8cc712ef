//! The time line of an incident: what began when, with its band, how long it lasted, and the time before it; or, of a log without
//! an event, when it came closest.

use maud::{Markup, html};
use tipwatch_language::{decimals, say, word};
use tipwatch_mechanics::Quantity;

use super::answers::doubt;
use super::witness::earlier;
use crate::analysis::Analysis;
use crate::events::support_words::{SupportWord, edge_word};
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
/// From one line of text to the next, and most letters of one: in the mean those of wide fonts are 0.54 of their size wide.
const LINE: f64 = 12.0;
const MOST_LETTERS: usize = 70;
/// Most lanes, of what is missing, and of what is less likely than not.
const MOST_LANES: usize = 7;
const MOST_MISSING: usize = 3;
const MOST_UNLIKELY: usize = 2;
/// An earlier incident is shown up to so long before (s), and a fall at the end of the log so long after: farther away, nothing else
/// would be seen.
const EARLIER_S: f64 = 30.0;
/// Bars of a lane that are closer than this share of the log are one.
const SEEN_SHARE: f64 = 1.0 / 400.0;

/// What is missing: label, and start and end of each time (s).
type Lane = (String, Vec<[f64; 2]>);

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
    let end_s = last_s(analysis) + analysis.coverage.after_rows_s;
    let whole_s = incident.is_none().then_some([0.0, end_s]);
    let ends = || steps.iter().flat_map(|step| &step.spans_s).chain(&whole_s);
    let from = ends().map(|span| span[0]).fold(f64::INFINITY, f64::min);
    let to = ends().map(|span| span[1]).fold(f64::NEG_INFINITY, f64::max);
    let span = (to - from).max(0.1);
    let at = |s: f64| BORDER + (s - from) / span * (WIDTH - 2.0 * BORDER);
    let mut height = 0.0;
    let lanes = steps.iter().map(|step| {
        let (top, lines) = (height, broken(&format!("{}: {}", step.label, step.note)));
        let text = TEXT + LINE * lines.len().saturating_sub(1) as f64;
        height += LANE - TEXT + text;
        (step, lines, top, top + text + 3.0)
    });
    let lanes: Vec<_> = lanes.collect();
    let (floor, height) = (height + 3.0, height + 18.0);
    let told: Vec<String> = steps
        .iter()
        .map(|step| format!("{} {}", step.label, step.note))
        .collect();
    let title = word!("Time line, with bands of two standard deviations");
    html! {
        figure.timeline {
            svg.chart viewBox=(format_args!("0 0 {WIDTH} {height:.0}")) role="img" aria-label=(format_args!("{title}: {}", told.join("; "))) {
                @for (step, lines, top, bar) in &lanes {
                    @let middle = bar + BAR / 2.0;
                    @for (place, line) in lines.iter().enumerate() {
                        @let y = top + TEXT + LINE * place as f64;
                        text x=(tenth(BORDER)) y=(tenth(y)) font-size=(LETTERS) text-anchor="start" { (line) }
                    }
                    @for &[from_s, to_s] in &step.spans_s {
                        @let (left, right) = (at(from_s), at(to_s).max(at(from_s) + 2.0));
                        rect class=(step.class) x=(tenth(left)) y=(tenth(*bar)) width=(tenth(right - left)) height=(tenth(BAR)) {}
                    }
                    @if let Some((band_s, &[from_s, _])) = step.band_s.zip(step.spans_s.first()) {
                        @let (low, high) = (at((from_s - band_s).max(from)), at((from_s + band_s).min(to)));
                        line class="step-band" x1=(tenth(low)) y1=(tenth(middle)) x2=(tenth(high)) y2=(tenth(middle)) {}
                    }
                }
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
    let ends = steps.iter().flat_map(|step| &step.spans_s);
    let to_s = ends.map(|span| span[1]).fold(0.0, f64::max);
    steps.extend(turning(analysis, scene).filter(|step| step.spans_s[0][0] < to_s + EARLIER_S));
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
    let spans = || steps.iter().flat_map(|step| &step.spans_s);
    let from_s = spans().map(|span| span[0]).fold(f64::INFINITY, f64::min);
    let to_s = spans().map(|span| span[1]).fold(0.0, f64::max);
    let room = MOST_LANES.saturating_sub(steps.len());
    let missing = missing(analysis, scene, [from_s, to_s]);
    steps.extend(missing.into_iter().take(room));
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
    let whole = Step {
        spans_s: known_s(analysis),
        ..Step::one(
            word!("log").into(),
            "step-known",
            [0.0; 2],
            seen(analysis, scene, incidents).into(),
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
        .chain(turning(analysis, scene))
        .chain(missing(analysis, scene, [0.0, last_s(analysis)]))
        .chain(after_rows(analysis))
        .collect()
}

/// What is seen in a log without an event that is a fact: never surer than its first finding.
fn seen(analysis: &Analysis, scene: &Scene, incidents: &[Incident<'_>]) -> &'static str {
    match (incidents.is_empty(), scene.is_sparse) {
        _ if analysis.turning.is_some() => word!("it ends while the platform turns"),
        (false, _) => word!("nothing is more likely than not"),
        _ if analysis.digest.doubted_rows > 0 => {
            word!("no event as computed, but signals contradict each other")
        }
        (true, true) => word!("no event at its rows as computed"),
        (true, false) if analysis.coverage.is_whole() => word!("no event as computed"),
        (true, false) => word!("no event as computed where its loads are known"),
    }
}

/// The lane of a fall that may have begun when the log ends.
fn turning(analysis: &Analysis, scene: &Scene) -> Option<Step> {
    let turning = analysis.turning.as_ref()?;
    let since_s = scene.seconds(turning.since_ns);
    Some(Step::one(
        say!("turns about the {} edge", edge_word(&turning.edge)),
        "step-tip",
        [since_s, last_s(analysis).max(since_s)],
        say!("from t = {since_s:.2} s; whether it fell is not known"),
    ))
}

/// The lane of the time after the last row.
fn after_rows(analysis: &Analysis) -> Option<Step> {
    let (last_s, after_s) = (last_s(analysis), analysis.coverage.after_rows_s);
    (after_s > 0.0).then(|| {
        Step::one(
            word!("after the last row").into(),
            "step-gap",
            [last_s, last_s + after_s],
            word!("nothing is computed").into(),
        )
    })
}

/// Times with known loads (s).
fn known_s(analysis: &Analysis) -> Vec<[f64; 2]> {
    let rows = &analysis.rows;
    let known = rows.reasons.iter().enumerate();
    let known = known.map(|(row, reasons)| (rows.seconds(row), reasons.leave_loads()));
    let seen_s = SEEN_SHARE * last_s(analysis);
    // between the rows of a sparse log its motion is bounded
    match analysis.coverage.between_rows {
        Some(_) => joined(between(known).into_iter(), seen_s),
        None => {
            let times = known.filter(|(_, is_known)| *is_known);
            let gap_s = analysis.machine.longest_known_gap_ns() as f64 * 1e-9;
            joined(times.map(|(at_s, _)| [at_s; 2]), gap_s.max(seen_s))
        }
    }
}

/// From each first known row to the last one before the next unknown row: by row, its time (s), and whether it is known.
fn between(rows: impl Iterator<Item = (f64, bool)>) -> Vec<[f64; 2]> {
    let mut all: Vec<[f64; 2]> = Vec::new();
    let mut goes_on = false;
    for (at_s, is_known) in rows {
        match all.last_mut() {
            Some(last) if is_known && goes_on => last[1] = at_s,
            _ if is_known => all.push([at_s; 2]),
            _ => {}
        }
        goes_on = is_known;
    }
    all
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

/// Signals with gaps, and times between rows in which a lift is not excluded, that reach into a time (s).
fn missing(analysis: &Analysis, scene: &Scene, [first_s, end_s]: [f64; 2]) -> Vec<Step> {
    let mut signals: Vec<Lane> = Vec::new();
    let mut between: Vec<[f64; 2]> = Vec::new();
    for event in &analysis.events {
        let to_s = event
            .end_ns
            .map_or(last_s(analysis), |end_ns| scene.seconds(end_ns));
        let span_s = [scene.seconds(event.start_ns), to_s];
        if span_s[0] > end_s || to_s < first_s {
            continue;
        }
        match event.kind {
            EventKind::InputGap => {
                let label = say!("without data: {}", scene.subject(event));
                match signals.iter_mut().find(|(known, _)| *known == label) {
                    Some((_, spans_s)) => spans_s.push(span_s),
                    None => signals.push((label, vec![span_s])),
                }
            }
            EventKind::LiftNotExcluded => between.push(span_s),
            _ => {}
        }
    }
    let near_s = SEEN_SHARE * last_s(analysis);
    let not_excluded = word!("lift not excluded between rows").to_owned();
    let not_excluded = (!between.is_empty()).then_some((not_excluded, between));
    let lanes = longest(signals).into_iter().chain(not_excluded);
    lanes
        .map(|(label, mut spans_s)| {
            spans_s.sort_by(|a, b| a[0].total_cmp(&b[0]));
            let note = match &spans_s[..] {
                &[[from_s, to_s]] => say!("t = {from_s:.2} to {to_s:.2} s"),
                all => say!("{} times", all.len()),
            };
            let within = spans_s.into_iter();
            let within = within.map(|[from_s, to_s]| [from_s.max(first_s), to_s.min(end_s)]);
            Step {
                spans_s: joined(within, near_s),
                ..Step::one(label, "step-gap", [0.0; 2], note)
            }
        })
        .collect()
}

/// Those that are missing for the longest time, the longest first, and the others as one.
fn longest(mut signals: Vec<Lane>) -> Vec<Lane> {
    let lasts_s = |lane: &Lane| -> f64 { lane.1.iter().map(|[from_s, to_s]| to_s - from_s).sum() };
    signals.sort_by(|a, b| lasts_s(b).total_cmp(&lasts_s(a)));
    let others = signals.split_off(signals.len().min(MOST_MISSING));
    let label: String = match others.len() {
        0 => return signals,
        1 => word!("and 1 more signal with gaps").into(),
        more => say!("and {more} more signals with gaps"),
    };
    let spans_s = others.into_iter().flat_map(|(_, spans_s)| spans_s);
    signals.push((label, spans_s.collect()));
    signals
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

/// A text in lines that fit.
fn broken(text: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + word.chars().count() < MOST_LETTERS => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}

fn tenth(value: f64) -> String {
    format!("{value:.1}")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use tipwatch_binding::MachineFile;

    use super::*;
    use crate::analysis::run::analyse;
    use crate::base::options::Options;
    use crate::events::Turning;

    #[test]
    fn bars_that_nobody_could_tell_apart_are_one() {
        let spans_s = [[0.0, 1.0], [1.01, 1.5], [1.2, 1.3], [2.0, 2.0], [9.0, 9.0]];
        let joined = joined(spans_s.into_iter(), 0.1);
        assert_eq!(joined, [[0.0, 1.5], [2.0, 2.0], [9.0, 9.0]]);
    }

    /// Lead times stood half outside of the picture.
    #[test]
    fn texts_of_the_time_line_fit() {
        let text = "tipping about the left edge: from t = 4.54 ± 0.09 s, lead time 1.68 s (wheel RR light)";
        let lines = broken(text);
        assert!(
            lines
                .iter()
                .all(|line| line.chars().count() <= MOST_LETTERS)
        );
        assert_eq!((lines.len(), lines.join(" ").as_str()), (2, text));
        assert_eq!(broken("log: no event as computed").len(), 1);
    }

    /// A sparse log with an hour of unknown rows in it showed a whole bar.
    #[test]
    fn the_bar_of_a_sparse_log_breaks_where_a_row_is_unknown() {
        let rows = [
            (0.0, true),
            (60.0, true),
            (120.0, false),
            (180.0, false),
            (240.0, true),
            (300.0, false),
            (360.0, true),
            (420.0, true),
        ];
        let bars = between(rows.into_iter());
        assert_eq!(bars, [[0.0, 60.0], [240.0, 240.0], [360.0, 420.0]]);
        assert!(between([(0.0, false)].into_iter()).is_empty());
    }

    /// The first three in the order of the events were shown, and of the others nothing was said.
    #[test]
    fn the_longest_gaps_have_a_lane_and_the_others_one_together() {
        let signal = |name: &str, spans_s: &[[f64; 2]]| (name.to_owned(), spans_s.to_vec());
        let short = [[1.0, 1.5]];
        let signals = vec![
            signal("a", &short),
            signal("b", &[[2.0, 3.0], [4.0, 5.0]]),
            signal("c", &[[0.0, 9.0]]),
            signal("d", &[[6.0, 7.5]]),
        ];
        let found = longest(signals.clone());
        let names: Vec<&str> = found.iter().map(|(label, _)| label.as_str()).collect();
        assert_eq!(names[..3], ["c", "b", "d"]);
        assert_eq!((found.len(), &found[3].1[..]), (4, &short[..]));
        let few = longest(signals[..3].to_vec());
        assert_eq!(few.len(), 3);
    }

    /// A log of a fixture, and what is seen of it.
    fn fixture(name: &str) -> Analysis {
        let log = format!("../tests/data/{name}.mcap");
        let log = Path::new(env!("CARGO_MANIFEST_DIR")).join(log);
        let file = MachineFile::read(&log.with_extension("toml")).unwrap();
        analyse(&log, &file, Options::default(), &mut |_| {}).unwrap()
    }

    /// An onset in a gap was told as "or earlier", and the time line did not show the gap.
    #[test]
    fn a_gap_has_a_lane_where_it_reaches_into_what_is_shown() {
        let mut analysis = fixture("tiny");
        let [from_ns, to_ns] = [10, 20].map(|row| analysis.rows.times_ns[row]);
        analysis.events = vec![Event {
            end_ns: Some(to_ns),
            ..Event::blank(EventKind::InputGap, from_ns, "imu".into())
        }];
        let scene = Scene::of(&analysis);
        let [from_s, to_s] = [from_ns, to_ns].map(|at_ns| scene.seconds(at_ns));
        let shown = |within_s| -> Vec<Vec<[f64; 2]>> {
            let lanes = missing(&analysis, &scene, within_s).into_iter();
            lanes.map(|step| step.spans_s).collect()
        };
        assert_eq!(shown([0.0, 2.0]), [[[from_s, to_s]]]);
        assert_eq!(shown([0.0, 0.15]), [[[from_s, 0.15]]]);
        assert!(shown([0.5, 2.0]).is_empty());
    }

    #[test]
    fn the_lanes_of_a_log_without_an_event_say_what_is_known() {
        let mut analysis = fixture("tiny");
        let lanes = |analysis: &Analysis| of_log(analysis, &Scene::of(analysis), &[]);
        let last_s = last_s(&analysis);
        let (row, _) = analysis.digest.lightest.unwrap();
        let at_s = analysis.rows.seconds(row);
        let found = lanes(&analysis);
        assert_eq!(found[0].class, "step-known");
        assert_eq!(found[0].spans_s, [[0.0, last_s]]);
        assert_eq!(found[1].spans_s, [[at_s; 2]]);
        assert_eq!(found.len(), 2);
        let seen_of = |analysis: &Analysis| seen(analysis, &Scene::of(analysis), &[]);
        let plain = seen_of(&analysis);
        // nothing is said more surely than the first finding does
        analysis.digest.doubted_rows = 1;
        let doubted = seen_of(&analysis);
        assert_ne!(doubted, plain);
        let since_ns = analysis.rows.times_ns[row];
        analysis.turning = Some(Turning {
            edge: "left".into(),
            since_ns,
            at_ns: since_ns,
            rotation_rad: 0.1,
            rate_rad_per_s: 0.5,
            lean_rad: 0.02,
            is_beyond_tyres: true,
            is_beyond_ground: false,
        });
        analysis.coverage.after_rows_s = 3.0;
        assert!(![plain, doubted].contains(&seen_of(&analysis)));
        let found = lanes(&analysis);
        assert_eq!(found[2].spans_s, [[at_s, last_s]]);
        assert_eq!(found[3].spans_s, [[last_s, last_s + 3.0]]);
        assert_eq!([found[2].class, found[3].class], ["step-tip", "step-gap"]);
    }
}
