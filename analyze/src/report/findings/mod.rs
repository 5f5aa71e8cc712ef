//! Findings: what happened, and the evidence for it.

mod of_event;
mod scene;
mod without_event;

use maud::{Markup, html};

pub(super) use scene::Scene;
pub(super) use without_event::reason_counts;

use super::{open_split, prevention, unstated_load};
use crate::analysis::Analysis;
use crate::analysis::inputs::GrossInput;
use crate::events::{Event, EventKind, Finding};
use crate::page::list;

/// Most events of a kind among the main findings.
pub(super) const MOST_OF_KIND: usize = 20;

/// The findings, the most important first. Times are seconds from the first row.
///
/// Never empty: without a wheel event the first finding states the minimum load, or why there is none.
#[must_use]
pub fn findings(analysis: &Analysis) -> Vec<Finding> {
    findings_of(analysis, usize::MAX)
}

/// The same, but of each kind of event only the worst ones. The last findings state how many were left out.
#[must_use]
pub fn main_findings(analysis: &Analysis) -> Vec<Finding> {
    findings_of(analysis, MOST_OF_KIND)
}

fn findings_of(analysis: &Analysis, most_of_kind: usize) -> Vec<Finding> {
    let scene = Scene::of(analysis);
    let (mut events, left_out) = worst_of_each_kind(&analysis.events, most_of_kind);
    events.sort_by_key(|event| (rank(event.kind), event.start_ns));
    let of_input = events.iter().position(|event| !event.kind.is_stability());
    let (stability, of_input) = events.split_at(of_input.unwrap_or(events.len()));
    let open = open_split::wheels(analysis);
    let may_conclude = analysis.gross_inputs.is_empty();
    let has_event = stability.iter().any(|event| event.kind.is_observed());
    let calm = (!has_event && may_conclude).then(|| scene.without_event(&open, analysis));
    let others = has_event.then(|| scene.other_wheels(stability, &open));
    let partly = has_event.then(|| without_event::partly_known(analysis));
    let finding = |event: &&Event| scene.finding(event);
    (analysis.gross_inputs.iter().map(gross_finding))
        .chain((analysis.losses.end_is_lost()).then(|| lost_end(analysis)))
        .chain(calm)
        .chain(stability.iter().map(finding))
        .chain(unstated_load::findings(analysis))
        .chain(others.flatten())
        .chain(partly.flatten().map(|known| unknown_rest(&known)))
        .chain(prevention::finding(analysis))
        .chain(of_input.iter().map(finding))
        .chain(left_out)
        .collect()
}

/// At most so many events of each kind, the worst ones, and a finding for each kind with more.
pub(super) fn worst_of_each_kind(events: &[Event], most: usize) -> (Vec<&Event>, Vec<Finding>) {
    let (mut kept, mut left_out) = (Vec::new(), Vec::new());
    for &kind in EventKind::all() {
        let mut of_kind: Vec<&Event> = events.iter().filter(|e| e.kind == kind).collect();
        if let Some(more) = of_kind.len().checked_sub(most).filter(|&more| more > 0) {
            of_kind.sort_by(|a, b| b.severity().total_cmp(&a.severity()));
            of_kind.truncate(most);
            left_out.push(Finding {
                headline: format!(
                    "{more} more events of kind {}, none of them worse, are in events.parquet",
                    kind.name()
                ),
                evidence: Vec::new(),
            });
        }
        kept.extend(of_kind);
    }
    (kept, left_out)
}

/// What the computed part of a log leaves open.
fn unknown_rest(known: &str) -> Finding {
    Finding {
        headline: format!("Wheel loads are known only in {known} of the log"),
        evidence: vec!["In the rest, wheels may have lifted unseen".into()],
    }
}

/// What stands in the way of every conclusion.
/// The end of the log is lost: whatever is said of it holds up to its last row.
fn lost_end(analysis: &Analysis) -> Finding {
    let last_s = analysis.rows.seconds(analysis.rows.len() - 1);
    let ranges = analysis.losses.ranges.iter();
    let lost = ranges.filter(|range| range.last_time_ns.is_none());
    Finding {
        headline: format!(
            "The end of the log is lost: all findings hold up to t = {last_s:.2} s, and what happened afterwards is not known"
        ),
        evidence: lost.map(ToString::to_string).collect(),
    }
}

fn gross_finding(input: &GrossInput) -> Finding {
    let fix = format!("Likely correction: {}", input.fix);
    Finding {
        headline: format!("No conclusion is possible. {}", input.headline),
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

/// The smaller, the more important.
pub(super) fn rank(kind: EventKind) -> usize {
    match kind {
        EventKind::TipOver => 0,
        EventKind::EdgeTipping => 1,
        EventKind::WheelLift => 2,
        EventKind::WheelLight => 3,
        EventKind::LiftNotExcluded => 4,
        EventKind::InputGap => 5,
        EventKind::InputFault => 6,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_kind_comes_first() {
        use EventKind::{EdgeTipping, InputGap, TipOver, WheelLift, WheelLight};
        let mut kinds = [InputGap, WheelLight, TipOver, WheelLift, EdgeTipping];
        kinds.sort_by_key(|&kind| rank(kind));
        assert_eq!(
            kinds,
            [TipOver, EdgeTipping, WheelLift, WheelLight, InputGap]
        );
    }
}
