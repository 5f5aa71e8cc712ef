//! What was found, in plain words.

use std::collections::BTreeMap;

use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::state::Reason;

use super::faults;
use crate::analysis::Analysis;
use crate::base::number::number;
use crate::events::{Event, EventCauses, EventKind};

/// Causes with less of the lost load are not named (%).
const LEAST_PERCENT: f64 = 2.0;
/// Most causes that a sentence names.
const MOST_CAUSES: usize = 3;

/// What was found, in plain sentences, the most important first. Times are seconds from the first row.
///
/// Never empty: without a wheel event the first sentence tells the lowest load, or why there is none.
#[must_use]
pub fn findings(analysis: &Analysis) -> Vec<String> {
    let scene = Scene::of(analysis);
    let mut events: Vec<&Event> = analysis.events.iter().collect();
    events.sort_by_key(|event| (rank(event.kind), event.start_ns));
    let wheel_event = events.iter().any(|event| !is_of_input(event.kind));
    let lowest = (!wheel_event).then(|| scene.without_event(lowest_load(analysis), analysis));
    lowest
        .into_iter()
        .chain(events.into_iter().map(|event| scene.sentence(event)))
        .collect()
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

/// Whether an event is about a signal, not about the machine.
fn is_of_input(kind: EventKind) -> bool {
    matches!(kind, EventKind::InputGap | EventKind::InputFault)
}

/// What sentences need to know beside the event.
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
        let wheels = analysis
            .machine
            .wheels()
            .iter()
            .enumerate()
            .map(|(wheel, facts)| WheelFacts {
                name: facts.name.clone(),
                static_n: analysis
                    .machine
                    .reference()
                    .static_load
                    .get(wheel)
                    .copied()
                    .unwrap_or(f64::NAN),
                limit_n: analysis
                    .min_loads_n
                    .as_ref()
                    .and_then(|limits| limits.get(wheel))
                    .copied(),
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

    /// The wheel, edge or signal as a reader knows it.
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

    fn sentence(&self, event: &Event) -> String {
        let when = format!(
            "from t = {:.2} s, {}",
            self.seconds(event.start_ns),
            duration(event)
        );
        let mut sentence = format!("{} {when}: {}", self.what(event), self.how_bad(event));
        if !is_of_input(event.kind) {
            sentence.push_str(&format!(", at t = {:.2} s", self.seconds(event.worst_ns)));
        }
        if let Some(lead_s) = event.lead_s {
            sentence.push_str(&format!(
                "; it began {lead_s:.2} s after the first wheel became light (lead time)"
            ));
        }
        if let Some(certainty) = event.certainty {
            sentence.push_str(&format!(
                "; probability that it is true {}",
                probability(certainty)
            ));
        }
        if event.split_dependent == Some(true) {
            sentence.push_str("; depends on how the loads split between the wheels");
        }
        sentence.push('.');
        if let Some(causes) = &event.causes {
            sentence.push_str(&self.why(causes));
        }
        sentence
    }

    /// What took the load away: the largest causes, as computed.
    fn why(&self, causes: &EventCauses) -> String {
        let lost_n = causes.otf_before_n - causes.otf_n;
        if !(lost_n > 0.0) {
            return String::new();
        }
        let since = match causes.since_is_steady {
            true => "Since the machine was last steady",
            false => "Since the first valid row",
        };
        let named: Vec<String> = (causes.shares.iter())
            .filter(|share| share.percent >= LEAST_PERCENT)
            .take(MOST_CAUSES)
            .map(|share| format!("{} {:.0} %", share.cause.replace('_', " "), share.percent))
            .collect();
        format!(
            " {since}, at t = {:.2} s, the OTF fell by {} N to {} N; computed shares: {}.",
            self.seconds(causes.since_ns),
            number(lost_n),
            number(causes.otf_n),
            named.join(", ")
        )
    }

    fn what(&self, event: &Event) -> String {
        let subject = self.subject(event);
        match event.kind {
            EventKind::TipOver => format!("The machine tipped over about the {subject} edge"),
            EventKind::EdgeTipping => format!("The machine was tipping about the {subject} edge"),
            EventKind::WheelLift => format!("Wheel {subject} lifted: it carried nothing"),
            EventKind::WheelLight => format!("Wheel {subject} was light"),
            EventKind::InputGap => format!("Input {subject} was missing"),
            EventKind::InputFault => format!("Input {subject} was implausible"),
        }
    }

    fn how_bad(&self, event: &Event) -> String {
        if let Some(fault) = &event.fault {
            return faults::how_bad(event, fault);
        }
        if !event.worst.is_finite() {
            return "the worst value is not computable".to_string();
        }
        let worst = format!("{} {}", number(event.worst), event.unit);
        match event.kind {
            EventKind::TipOver => {
                format!("the tilt grew by {:.1} degrees", event.worst.to_degrees())
            }
            EventKind::EdgeTipping => format!("largest overturning moment {worst}"),
            EventKind::WheelLift => {
                format!("lowest load with all wheels held to the ground (OTF) {worst}")
            }
            EventKind::WheelLight => format!("lowest load {worst}{}", self.shares(event)),
            EventKind::InputGap | EventKind::InputFault => format!(
                "no value for {:.2} s; nothing is computed there",
                event.worst
            ),
        }
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

    fn without_event(&self, lowest: Option<LowestLoad>, analysis: &Analysis) -> String {
        let Some(lowest) = lowest else {
            return format!(
                "Wheel loads are not computable in any row: {}.",
                reasons(analysis)
            );
        };
        let wheel = &self.wheels[lowest.wheel];
        let claim = match wheel.limit_n {
            Some(_) => "No wheel came below its limit",
            None => "No wheel lifted (no load limit is set)",
        };
        let rows = analysis.rows.len();
        let scope = match lowest.valid_rows == rows {
            true => String::new(),
            false => format!(
                " This covers the {} of {rows} rows that are valid.",
                lowest.valid_rows
            ),
        };
        format!(
            "{claim}; the lowest load was {} N ({}) at wheel {}, t = {:.2} s.{scope}",
            number(lowest.load_n),
            share(lowest.load_n, wheel.static_n),
            wheel.name,
            self.seconds(lowest.time_ns)
        )
    }
}

/// How often each reason makes a row invalid, for a sentence.
fn reasons(analysis: &Analysis) -> String {
    let counts = reason_counts(analysis);
    if counts.is_empty() {
        return "there are no rows".to_string();
    }
    let parts: Vec<String> = counts
        .iter()
        .map(|(reason, rows)| format!("{} in {rows} rows", reason.name()))
        .collect();
    parts.join(", ")
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

fn lowest_load(analysis: &Analysis) -> Option<LowestLoad> {
    let rows = &analysis.rows;
    let valid: Vec<usize> = (0..rows.len())
        .filter(|&row| rows.reasons[row].is_empty())
        .collect();
    let mut lowest: Option<LowestLoad> = None;
    for wheel in 0..analysis.machine.wheels().len() {
        let loads = rows.outcomes.column(Quantity::Load(wheel));
        for &row in &valid {
            let is_lower = lowest
                .as_ref()
                .is_none_or(|lowest| loads[row] < lowest.load_n);
            if loads[row].is_finite() && is_lower {
                let (load_n, time_ns) = (loads[row], rows.times_ns[row]);
                lowest = Some(LowestLoad {
                    wheel,
                    load_n,
                    time_ns,
                    valid_rows: valid.len(),
                });
            }
        }
    }
    lowest
}

fn duration(event: &Event) -> String {
    match event.end_ns {
        Some(end_ns) => format!(
            "for {:.2} s",
            end_ns.saturating_sub(event.start_ns) as f64 * 1e-9
        ),
        None => "until the log ends".to_string(),
    }
}

fn share(load_n: f64, static_n: f64) -> String {
    if load_n.is_finite() && static_n > 0.0 {
        // plus zero: a load of minus nothing reads as nothing
        let percent = (load_n / static_n * 1000.0).round() / 10.0 + 0.0;
        format!("{percent:.1} % of its static load")
    } else {
        "its static load is not computable".to_string()
    }
}

/// A probability in per cent: nothing is ever quite certain.
pub(super) fn probability(value: f64) -> String {
    match 100.0 * value {
        percent if percent > 99.9 => "above 99.9 %".into(),
        percent if percent < 0.1 => "below 0.1 %".into(),
        percent => format!("{percent:.0} %"),
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
    fn a_light_wheel_is_told_with_share_limit_and_times() {
        let sentence = scene().sentence(&event(EventKind::WheelLight, "rl", 250.0, "N"));
        assert_eq!(
            sentence,
            "Wheel RL was light from t = 2.50 s, for 0.50 s: lowest load 250 N (2.5 % of its static load, limit 500 N), \
             at t = 2.75 s."
        );
    }

    #[test]
    fn lead_time_and_doubt_are_told() {
        let doubtful = Event {
            lead_s: Some(0.4),
            split_dependent: Some(true),
            ..event(EventKind::WheelLift, "rl", -80.0, "N")
        };
        let sentence = scene().sentence(&doubtful);
        assert!(sentence.contains("0.40 s after the first wheel became light"));
        assert!(sentence.ends_with("; depends on how the loads split between the wheels."));
    }

    #[test]
    fn an_open_tip_over_lasts_until_the_log_ends_and_is_in_degrees() {
        let open = Event {
            end_ns: None,
            ..event(EventKind::TipOver, "left", 0.5, "rad")
        };
        let sentence = scene().sentence(&open);
        assert!(
            sentence.contains("about the left edge") && sentence.contains("until the log ends")
        );
        assert!(sentence.contains("28.6 degrees"));
    }

    #[test]
    fn what_cannot_be_computed_is_said() {
        let sentence = scene().sentence(&event(EventKind::WheelLift, "fl", f64::NAN, "N"));
        assert!(sentence.contains("not computable") && !sentence.contains("NaN"));
    }

    #[test]
    fn nothing_is_certain() {
        assert_eq!(probability(1.0), "above 99.9 %");
        assert_eq!(probability(0.974), "97 %");
        assert_eq!(probability(0.0), "below 0.1 %");
    }

    #[test]
    fn nothing_has_no_sign() {
        let sentence = scene().sentence(&event(EventKind::WheelLight, "fl", -1e-13, "N"));
        assert!(
            sentence.contains("lowest load 0 N (0.0 % of its static load"),
            "{sentence}"
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
