//! Findings: what happened, and the evidence for it.

use std::collections::BTreeMap;

use maud::{Markup, html};
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::state::Reason;

use super::{faults, prevention};
use crate::analysis::Analysis;
use crate::analysis::inputs::GrossInput;
use crate::events::{Event, EventCauses, EventKind, Finding};
use crate::page::{list, number, percent, probability, readable};

/// Causes with a smaller share of the lost load are not named (%).
const LEAST_PERCENT: f64 = 2.0;
/// Most causes that a finding names.
const MOST_CAUSES: usize = 3;

/// The findings, the most important first. Times are seconds from the first row.
///
/// Never empty: without a wheel event the first finding states the minimum load, or why there is none.
#[must_use]
pub fn findings(analysis: &Analysis) -> Vec<Finding> {
    let scene = Scene::of(analysis);
    let mut events: Vec<&Event> = analysis.events.iter().collect();
    events.sort_by_key(|event| (rank(event.kind), event.start_ns));
    let of_input = events.iter().position(|event| !event.kind.is_stability());
    let (stability, of_input) = events.split_at(of_input.unwrap_or(events.len()));
    let may_conclude = analysis.gross_inputs.is_empty();
    let calm = (stability.is_empty() && may_conclude)
        .then(|| scene.without_event(lowest_load(analysis), analysis));
    let partly = (!stability.is_empty())
        .then(|| partly_known(analysis))
        .flatten();
    let finding = |event: &&Event| scene.finding(event);
    (analysis.gross_inputs.iter().map(gross_finding))
        .chain(calm)
        .chain(stability.iter().map(finding))
        .chain(partly.map(|known| unknown_rest(&known)))
        .chain(prevention::finding(analysis))
        .chain(of_input.iter().map(finding))
        .collect()
}

/// What the computed part of a log leaves open.
fn unknown_rest(known: &str) -> Finding {
    Finding {
        headline: format!("Wheel loads are known only in {known} of the log"),
        evidence: vec!["In the rest, wheels may have lifted unseen".into()],
    }
}

/// What stands in the way of every conclusion.
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
        EventKind::InputGap => 4,
        EventKind::InputFault => 5,
    }
}

/// The facts of the analysis that findings use besides the event.
pub(super) struct Scene {
    start_ns: i64,
    wheels: Vec<WheelFacts>,
}

struct WheelFacts {
    name: String,
    static_n: f64,
    limit_n: Option<f64>,
}

struct LowestLoad {
    wheel: usize,
    load_n: f64,
    time_ns: i64,
    valid_rows: usize,
}

impl Scene {
    pub(super) fn of(analysis: &Analysis) -> Self {
        let machine = &analysis.machine;
        let limits = analysis.min_loads_n.as_deref().unwrap_or_default();
        let wheels = machine.wheels().iter().enumerate();
        let wheels = wheels.map(|(wheel, facts)| WheelFacts {
            name: facts.name.clone(),
            static_n: machine.reference().static_load[wheel],
            limit_n: limits.get(wheel).copied(),
        });
        Self {
            start_ns: analysis.rows.times_ns.first().copied().unwrap_or(0),
            wheels: wheels.collect(),
        }
    }

    /// Seconds from the first row.
    pub(super) fn seconds(&self, time_ns: i64) -> f64 {
        time_ns.saturating_sub(self.start_ns) as f64 * 1e-9
    }

    /// Display name of the wheel, edge or signal.
    pub(super) fn subject(&self, event: &Event) -> String {
        match event.kind {
            EventKind::WheelLight | EventKind::WheelLift => self
                .wheel(&event.subject)
                .map_or_else(|| event.subject.clone(), |wheel| wheel.name.clone()),
            _ => event.subject.clone(),
        }
    }

    fn wheel(&self, subject: &str) -> Option<&WheelFacts> {
        self.wheels
            .iter()
            .find(|wheel| wheel.name.to_lowercase() == subject)
    }

    fn finding(&self, event: &Event) -> Finding {
        let confidence = event.certainty.map_or(String::new(), |certainty| {
            format!(" (confidence {})", probability(certainty))
        });
        let start = self.seconds(event.start_ns);
        Finding {
            headline: format!(
                "{} from t = {start:.2} s {}{confidence}",
                self.statement(event),
                duration(event)
            ),
            evidence: self.evidence(event),
        }
    }

    fn statement(&self, event: &Event) -> String {
        let subject = self.subject(event);
        match event.kind {
            EventKind::TipOver => format!("The machine tipped over about the {subject} edge"),
            EventKind::EdgeTipping => format!("The machine was tipping about the {subject} edge"),
            EventKind::WheelLift => format!("Wheel {subject} was off the ground"),
            EventKind::WheelLight => format!("Wheel {subject} was below its load limit"),
            EventKind::InputGap => format!("Input {subject} had no data"),
            EventKind::InputFault => format!("Input {subject} was implausible"),
        }
    }

    fn evidence(&self, event: &Event) -> Vec<String> {
        if let Some(fault) = &event.fault {
            return faults::evidence(event, fault);
        }
        let mut evidence = vec![self.worst(event)];
        if let Some(lead_s) = event.lead_s {
            evidence.push(format!(
                "Lead time: {lead_s:.2} s after the first wheel fell below its load limit"
            ));
        }
        if event.split_dependent == Some(true) {
            evidence.push("Depends on how the load is split between the wheels".into());
        }
        if let Some(causes) = &event.causes {
            evidence.extend(self.causes(causes));
        }
        evidence
    }

    fn worst(&self, event: &Event) -> String {
        let worst = match event.kind {
            _ if !event.worst.is_finite() => "not computable".to_string(),
            _ => format!("{} {}", number(event.worst), event.unit),
        };
        let at = format!("at t = {:.2} s", self.seconds(event.worst_ns));
        match event.kind {
            EventKind::TipOver if event.worst.is_finite() => {
                format!("Tilt increased by {:.1}°, {at}", event.worst.to_degrees())
            }
            EventKind::TipOver => format!("Increase of the tilt: {worst}, {at}"),
            EventKind::EdgeTipping => format!("Maximum overturning moment: {worst}, {at}"),
            EventKind::WheelLift => format!("Minimum overturning force (OTF): {worst}, {at}"),
            EventKind::WheelLight => {
                format!("Minimum load: {worst}{}, {at}", self.shares(event))
            }
            EventKind::InputGap | EventKind::InputFault => {
                format!(
                    "No value for {:.2} s; nothing is computed there",
                    event.worst
                )
            }
        }
    }

    /// How much load was lost since when, and the largest causes.
    fn causes(&self, causes: &EventCauses) -> Vec<String> {
        let lost_n = causes.otf_before_n - causes.otf_n;
        if !(lost_n > 0.0) {
            return Vec::new();
        }
        let since = match causes.since_is_steady {
            true => "the machine was last steady",
            false => "the first valid row",
        };
        let fall = format!(
            "Overturning force (OTF) down by {} N to {} N since {since}, at t = {:.2} s",
            number(lost_n),
            number(causes.otf_n),
            self.seconds(causes.since_ns),
        );
        let named: Vec<String> = (causes.shares.iter())
            .filter(|share| share.percent >= LEAST_PERCENT)
            .take(MOST_CAUSES)
            .map(|share| format!("{} {:.0} %", readable(share.cause), share.percent))
            .collect();
        let causes = format!("Computed causes: {}", named.join(", "));
        [Some(fall), (!named.is_empty()).then_some(causes)]
            .into_iter()
            .flatten()
            .collect()
    }

    fn shares(&self, event: &Event) -> String {
        let Some(wheel) = self.wheel(&event.subject) else {
            return String::new();
        };
        let limit = wheel.limit_n.map_or(String::new(), |limit| {
            format!(", limit {} N", number(limit))
        });
        format!(" ({}{limit})", share(event.worst, wheel.static_n))
    }

    fn without_event(&self, lowest: Option<LowestLoad>, analysis: &Analysis) -> Finding {
        let Some(lowest) = lowest else {
            return Finding {
                headline: "Wheel loads cannot be computed in any row".into(),
                evidence: reasons(analysis),
            };
        };
        let wheel = &self.wheels[lowest.wheel];
        let claim = match wheel.limit_n {
            Some(_) => "o wheel fell below its load limit",
            None => "o wheel left the ground",
        };
        let claim = match partly_known(analysis) {
            Some(known) => format!("In the {known} of the log with known wheel loads, n{claim}"),
            None => format!("N{claim}"),
        };
        let limit = match wheel.limit_n {
            Some(limit_n) => format!("Load limit of wheel {}: {} N", wheel.name, number(limit_n)),
            None => "No load limit is set".into(),
        };
        let (rows, valid) = (analysis.rows.len(), lowest.valid_rows);
        let scope = (valid < rows)
            .then(|| format!("Based on the {valid} valid rows of {rows}; the others are unknown"));
        Finding {
            headline: format!(
                "{claim}; the minimum load was {} N ({}) on wheel {} at t = {:.2} s",
                number(lowest.load_n),
                share(lowest.load_n, wheel.static_n),
                wheel.name,
                self.seconds(lowest.time_ns)
            ),
            evidence: [limit].into_iter().chain(scope).collect(),
        }
    }
}

/// The time with known loads, of a log of which more than a hundredth is unknown.
fn partly_known(analysis: &Analysis) -> Option<String> {
    const WHOLE: f64 = 0.99;
    let is_whole = analysis
        .coverage
        .valid_share
        .is_some_and(|share| share >= WHOLE);
    (!is_whole).then(|| analysis.coverage.to_string())
}

/// How often each reason makes a row invalid.
fn reasons(analysis: &Analysis) -> Vec<String> {
    if analysis.rows.is_empty() {
        return vec!["There are no rows".into()];
    }
    let counts = reason_counts(analysis).into_iter();
    counts
        .map(|(reason, rows)| format!("{} in {rows} rows", readable(reason.name())))
        .collect()
}

/// In how many rows each reason occurs.
pub(super) fn reason_counts(analysis: &Analysis) -> BTreeMap<Reason, usize> {
    let mut counts = BTreeMap::new();
    for reason in analysis
        .rows
        .reasons
        .iter()
        .flat_map(|reasons| reasons.iter())
    {
        *counts.entry(reason).or_default() += 1;
    }
    counts
}

/// The lowest load of the valid rows, the first of equal ones.
fn lowest_load(analysis: &Analysis) -> Option<LowestLoad> {
    let rows = &analysis.rows;
    let valid = || (0..rows.len()).filter(|&row| rows.reasons[row].is_empty());
    let load = |wheel: usize, row: usize| rows.outcomes.column(Quantity::Load(wheel))[row];
    let wheels = 0..analysis.machine.wheels().len();
    let loads = wheels.flat_map(|wheel| valid().map(move |row| (wheel, row, load(wheel, row))));
    let finite = loads.filter(|(_, _, load_n)| load_n.is_finite());
    let (wheel, row, load_n) =
        finite.reduce(|least, next| if next.2 < least.2 { next } else { least })?;
    Some(LowestLoad {
        wheel,
        load_n,
        time_ns: rows.times_ns[row],
        valid_rows: valid().count(),
    })
}

fn duration(event: &Event) -> String {
    match event.end_ns {
        Some(end_ns) => format!(
            "for {:.2} s",
            end_ns.saturating_sub(event.start_ns) as f64 * 1e-9
        ),
        None => "until the end of the log".to_string(),
    }
}

fn share(load_n: f64, static_n: f64) -> String {
    if load_n.is_finite() && static_n > 0.0 {
        format!("{} of its static load", percent(load_n / static_n))
    } else {
        "its static load is not computable".to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> Scene {
        let wheel = |name: &str| WheelFacts {
            name: name.into(),
            static_n: 10_000.0,
            limit_n: Some(500.0),
        };
        Scene {
            start_ns: 1_000_000_000_000,
            wheels: vec![wheel("FL"), wheel("RL")],
        }
    }

    fn event(kind: EventKind, subject: &str, worst: f64, unit: &'static str) -> Event {
        Event {
            kind,
            subject: subject.into(),
            worst,
            unit,
            start_ns: 1_002_500_000_000,
            end_ns: Some(1_003_000_000_000),
            worst_ns: 1_002_750_000_000,
            lead_s: None,
            certainty: None,
            split_dependent: None,
            causes: None,
            fault: None,
        }
    }

    #[test]
    fn headline_says_what_when_and_how_certain() {
        let light = Event {
            certainty: Some(0.97),
            ..event(EventKind::WheelLight, "rl", 250.0, "N")
        };
        let finding = scene().finding(&light);
        assert_eq!(
            finding.to_string(),
            "Wheel RL was below its load limit from t = 2.50 s for 0.50 s (confidence 97 %)\n    \
             Minimum load: 250 N (2.5 % of its static load, limit 500 N), at t = 2.75 s"
        );
    }

    #[test]
    fn lead_time_and_doubt_are_evidence() {
        let doubtful = Event {
            lead_s: Some(0.4),
            split_dependent: Some(true),
            ..event(EventKind::WheelLift, "rl", -80.0, "N")
        };
        assert_eq!(
            scene().finding(&doubtful).evidence,
            [
                "Minimum overturning force (OTF): -80.0 N, at t = 2.75 s",
                "Lead time: 0.40 s after the first wheel fell below its load limit",
                "Depends on how the load is split between the wheels"
            ]
        );
    }

    #[test]
    fn an_open_tip_over_lasts_until_the_end_of_the_log() {
        let open = Event {
            end_ns: None,
            ..event(EventKind::TipOver, "left", 0.5, "rad")
        };
        let finding = scene().finding(&open);
        assert_eq!(
            finding.headline,
            "The machine tipped over about the left edge from t = 2.50 s until the end of the log"
        );
        assert!(finding.evidence[0].contains("28.6°"));
    }

    #[test]
    fn missing_values_are_stated_as_such() {
        let finding = scene().finding(&event(EventKind::WheelLift, "fl", f64::NAN, "N"));
        let text = finding.to_string();
        assert!(text.contains("not computable") && !text.contains("NaN"));
    }

    #[test]
    fn zero_has_no_sign() {
        let finding = scene().finding(&event(EventKind::WheelLight, "fl", -1e-13, "N"));
        let worst = &finding.evidence[0];
        assert!(
            worst.contains("Minimum load: 0 N (0.0 % of its static load"),
            "{worst}"
        );
    }

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
