//! Findings: what happened, and the evidence for it.

mod headline;
mod incident;
mod of_event;
mod scene;
mod without_event;

use maud::{Markup, html};
use tipwatch_language::{message, say, word};
use tipwatch_mechanics::machine::{Note, NoteKind};

pub(super) use crate::base::number::enumerated;
pub(super) use incident::{Incident, incidents, led_to};
pub(super) use of_event::input_list;
pub(super) use scene::Scene;
pub(super) use without_event::reason_counts;

use super::{measured_loads, open_split, prevention, unstated_load};
use crate::analysis::Analysis;
use crate::analysis::inputs::GrossInput;
use crate::events::support_words::{SupportWord, edge_word};
use crate::events::{Event, EventKind, Finding};
use crate::page::list;

/// Meaning of ± in every finding.
pub const BANDS: &str = message!("±: two standard deviations");
/// Most events of a kind among the main findings.
const MOST_OF_KIND: usize = 20;
/// Most losses told in their finding.
const MOST_LOST: usize = 3;

/// The findings, the most important first. Times are seconds from the first row.
///
/// Never empty: without a wheel event the first finding states the smallest load compared with that at rest, or why there is none.
#[must_use]
pub fn findings(analysis: &Analysis) -> Vec<Finding> {
    findings_of(analysis, usize::MAX)
}

/// Returns the main findings: the gravest incidents only, and of each other kind of event the worst ones. The last findings state
/// how many were left out.
#[must_use]
pub fn main_findings(analysis: &Analysis) -> Vec<Finding> {
    findings_of(analysis, MOST_OF_KIND)
}

fn findings_of(analysis: &Analysis, most_of_kind: usize) -> Vec<Finding> {
    let scene = Scene::of(analysis);
    let incidents = incidents(&analysis.events);
    let others = analysis
        .events
        .iter()
        .filter(|event| !event.kind.is_observed());
    let (mut events, left_out) = worst_of_each_kind(others, scene.word, most_of_kind);
    events.sort_by_key(|event| (event.kind.rank(), event.start_ns));
    let of_input = events.iter().position(|event| !event.kind.is_stability());
    let (not_excluded, of_input) = events.split_at(of_input.unwrap_or(events.len()));
    let open = open_split::wheels(analysis);
    let may_conclude = analysis.gross_inputs.is_empty();
    let has_event = !incidents.is_empty();
    let calm = (!has_event && may_conclude).then(|| scene.without_event(&open, analysis));
    let other_wheels = has_event.then(|| scene.other_wheels(&incidents, &open));
    let partly = has_event.then(|| without_event::partly_known(analysis));
    let finding = |event: &&Event| scene.finding(event);
    (analysis.gross_inputs.iter().map(gross_finding))
        .chain(losses(analysis))
        .chain(open_fall(analysis, &scene))
        .chain(calm)
        .chain(incidents.first().map(|it| scene.of_incident(it)))
        .chain(measured_loads::findings(analysis))
        .chain((incidents.iter().take(most_of_kind).skip(1)).map(|it| scene.of_incident(it)))
        .chain(not_excluded.iter().map(finding))
        .chain(unstated_load::findings(analysis))
        .chain(other_wheels.flatten())
        .chain(partly.flatten().map(|known| unknown_rest(&scene, &known)))
        .chain(prevention::finding(analysis))
        .chain(of_input.iter().map(finding))
        .chain((incidents.len() > most_of_kind).then(|| more(incidents.len() - most_of_kind)))
        .chain(left_out)
        .collect()
}

/// Returns the doubts about the computed loads beside gross inputs and implausible signals, one sentence each.
#[must_use]
pub fn doubts(analysis: &Analysis) -> Vec<String> {
    let told = unstated_load::not_as_stated(analysis).chain(measured_loads::findings(analysis));
    let casts_doubt = |note: &&Note| {
        let kinds = [NoteKind::InputFault, NoteKind::ImuMountingConflict];
        kinds.contains(&note.kind)
    };
    let notes = analysis.notes.iter().filter(casts_doubt);
    told.map(|finding| finding.headline)
        .chain(notes.map(ToString::to_string))
        .collect()
}

fn more(incidents: usize) -> Finding {
    Finding {
        headline: say!("{incidents} more incidents, none of them graver, are in events.parquet"),
        evidence: Vec::new(),
    }
}

/// At most so many events of each kind, the worst ones, and a finding for each kind with more.
pub(super) fn worst_of_each_kind<'a>(
    events: impl Iterator<Item = &'a Event>,
    word: SupportWord,
    most: usize,
) -> (Vec<&'a Event>, Vec<Finding>) {
    let all: Vec<&Event> = events.collect();
    let (mut kept, mut left_out) = (Vec::new(), Vec::new());
    for kind in EventKind::ALL {
        let of_kind = all.iter().copied().filter(|event| event.kind == kind);
        let mut of_kind: Vec<&Event> = of_kind.collect();
        if let Some(more) = of_kind.len().checked_sub(most).filter(|&more| more > 0) {
            of_kind.sort_by(|a, b| b.severity().total_cmp(&a.severity()));
            of_kind.truncate(most);
            left_out.push(Finding {
                headline: say!(
                    "{more} more events of the kind \"{}\", none of them worse, are in events.parquet",
                    word.event(kind)
                ),
                evidence: Vec::new(),
            });
        }
        kept.extend(of_kind);
    }
    (kept, left_out)
}

/// Returns the finding about the part of a log whose loads are unknown.
fn unknown_rest(scene: &Scene, known: &str) -> Finding {
    Finding {
        headline: say!(
            "{} loads are known only in {known} of the log",
            scene.word.head
        ),
        evidence: vec![say!(
            "In the rest, {} may have lifted unseen",
            scene.word.many
        )],
    }
}

/// Returns the finding about the lost parts of the log and the questions that they leave open.
fn losses(analysis: &Analysis) -> Option<Finding> {
    let losses = &analysis.losses;
    if losses.is_empty() {
        return None;
    }
    let last_s = (analysis.rows.len().checked_sub(1)).map(|last| analysis.rows.seconds(last));
    let headline = match last_s.filter(|_| losses.end_is_lost()) {
        Some(last_s) => say!(
            "The end of the log is lost: all findings hold up to t = {last_s:.2} s, and what happened afterwards is not known"
        ),
        None => word!("A part of the log is lost, and what happened in it is not known").into(),
    };
    let lines: Vec<String> = losses.lines().take(MOST_LOST + 1).collect();
    let more = (lines.len() > MOST_LOST).then(|| word!("More are in summary.json").to_string());
    let evidence = lines.into_iter().take(MOST_LOST).chain(more);
    Some(Finding {
        headline,
        evidence: evidence.collect(),
    })
}

/// A fall that may have begun when the log ends.
fn open_fall(analysis: &Analysis, scene: &Scene) -> Option<Finding> {
    let turning = analysis.turning.as_ref()?;
    let lean = say!(
        "It turns that way since t = {:.2} s; its tyres let it lean by {:.1}°",
        scene.seconds(turning.since_ns),
        turning.lean_rad.to_degrees()
    );
    let loads = (!turning.is_beyond_ground).then(|| {
        say!(
            "Tyres or ground could turn it so far, but hardly any computed load is left off the {} edge",
            edge_word(&turning.edge)
        )
    });
    Some(Finding {
        headline: say!("The log ends while {}", turning.in_words()),
        evidence: [lean].into_iter().chain(loads).collect(),
    })
}

/// Returns the finding about an input that excludes every conclusion.
fn gross_finding(input: &GrossInput) -> Finding {
    let fix = say!("Likely correction: {}", input.fix);
    Finding {
        headline: say!("No conclusion is possible. {}", input.headline),
        evidence: input.evidence.iter().cloned().chain([fix]).collect(),
    }
}

/// Findings as a list for a page, each with its evidence.
pub(super) fn finding_list(findings: &[Finding]) -> Markup {
    html! {
        ul.findings {
            @for finding in findings {
                li { strong { (finding.headline) } (list(&finding.evidence)) }
            }
        }
    }
}
