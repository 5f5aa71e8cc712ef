//! Differences of the summaries: events and figures of the whole log.

use std::collections::BTreeMap;

use serde::Serialize;
use tipwatch_language::{decimals, message, say, told, word};

use super::side::{Side, SideEvent};
use crate::base::number::{input_in_words, number, readable};
use crate::events::support_words::edge_word;
use crate::events::{EventKind, Reply};

/// A figure of the whole log on both sides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FactDifference {
    /// Its name.
    pub name: String,
    /// Its unit; "-" for a share, "events" for a count.
    pub unit: &'static str,
    /// Value on side A; null if not computable or not applicable.
    pub a: Option<f64>,
    /// Value on side B.
    pub b: Option<f64>,
    /// B minus A.
    pub difference: Option<f64>,
    /// Why the count of events of a side is null although the other side has one, or a figure although it could be computed.
    pub why_not: Option<&'static str>,
}

impl FactDifference {
    /// Whether the sides differ in it.
    pub(super) fn differs(&self) -> bool {
        self.a != self.b
    }

    /// Whether it is the least OTF of a wheel.
    pub(super) fn is_least_otf(&self) -> bool {
        self.name.starts_with(LEAST_OTF)
    }

    /// Its name as a reader reads it.
    pub(super) fn in_words(&self) -> String {
        // behind the label stands a name of the machine
        let of = self.name.rsplit_once(", ");
        match of.filter(|(_, of)| *of != "share") {
            Some((label, of)) => format!("{}, {of}", told(label)),
            None => readable(&self.name),
        }
    }
}

/// An event on one side or on both.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EventPair {
    /// Kind of the event.
    pub kind: String,
    /// Wheel, edge or signal.
    pub subject: String,
    /// On side A.
    pub a: Option<EventSide>,
    /// On side B.
    pub b: Option<EventSide>,
    /// The side without the event has rows in its time, of which fewer than one in ten is valid: it may or may not be there, too.
    pub is_open_elsewhere: bool,
    /// The side without the event shows that it is not there.
    #[serde(skip)]
    pub(super) is_only: bool,
    /// Whether a reader is told of it: not of what B has, too, besides its first event in the time of one that is answered.
    #[serde(skip)]
    pub(super) is_told: bool,
    /// Whether the event of A would have happened as supposed in B; null where nothing is supposed.
    pub supposed: Option<Reply>,
}

impl EventPair {
    /// What happened, and to what.
    pub(super) fn what(&self) -> String {
        let (wheel, subject) = (self.subject.to_uppercase(), edge_word(&self.subject));
        match self.kind.as_str() {
            "wheel_light" => say!("{} light", wheel),
            "wheel_lift" => say!("{} off the ground", wheel),
            "edge_tipping" => say!("tipping about the {subject} edge"),
            "tip_over" => say!("tipping over about the {subject} edge"),
            kind => format!("{}: {}", readable(kind), input_in_words(&self.subject)),
        }
    }

    /// Whether it would have happened as supposed in B.
    pub(super) fn answer(&self) -> Option<String> {
        let reply = self.supposed.as_ref()?;
        Some(reply.in_words().unwrap_or_else(|| {
            let why = told(reply.why_not.unwrap_or(message!("the reason is unknown")));
            say!("open ({why})")
        }))
    }
}

/// An event of one side.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EventSide {
    /// Start (s after the first row).
    pub start_s: f64,
    /// Duration (s); null if still active when the log ends.
    pub duration_s: Option<f64>,
    /// The worst value.
    pub worst: Option<f64>,
    /// Its unit.
    pub unit: String,
    /// Confidence: probability that it is true.
    pub certainty: Option<f64>,
}

/// Units in the order of the output.
const UNITS: [&str; 6] = ["events", "-", "N", "kg", "s", "rows"];

/// A value formatted for its unit.
pub(super) fn formatted(value: Option<f64>, unit: &str) -> String {
    match (value, unit) {
        (None, _) => word!("unknown").into(),
        (Some(value), "events" | "rows") => format!("{value:.0}"),
        (Some(value), "-") => decimals(format!("{value:.3}")),
        (Some(value), _) => number(value),
    }
}

const LEAST_OTF: &str = message!("least OTF");
const LEAST_MARGIN: &str = message!("least margin");
/// Figures of a wheel: key in the summary, label.
const OF_WHEEL: [(&str, &str); 6] = [
    ("least_otf_n", LEAST_OTF),
    ("least_load_n", message!("least load")),
    ("mean_load_n", message!("mean load")),
    ("largest_load_n", message!("largest load")),
    ("static_load_n", message!("static load")),
    (
        "median_load_sigma_n",
        message!("median standard deviation of the load"),
    ),
];

/// All figures, grouped by unit, the largest difference first; those on one side only come last.
pub(super) fn facts(a: &Side, b: &Side, pairs: &[EventPair]) -> Vec<FactDifference> {
    let (mut on_a, mut on_b) = (numbers(a), numbers(b));
    let mut open = leave_open(&mut on_a, &mut on_b, pairs);
    open.extend(leave_tipped(&mut on_a, a));
    open.extend(leave_tipped(&mut on_b, b));
    let names: std::collections::BTreeSet<_> = on_a.keys().chain(on_b.keys()).collect();
    let mut facts: Vec<FactDifference> = names
        .into_iter()
        .map(|key| {
            let value = |side: &BTreeMap<_, Option<f64>>| side.get(key).copied().flatten();
            let (a, b) = (value(&on_a), value(&on_b));
            FactDifference {
                name: key.1.clone(),
                unit: UNITS[key.0],
                a,
                b,
                difference: a.zip(b).map(|(a, b)| b - a),
                why_not: open.get(&key.1).copied(),
            }
        })
        .collect();
    let size = |fact: &FactDifference| fact.difference.map_or(-1.0, f64::abs);
    let unit = |fact: &FactDifference| UNITS.iter().position(|unit| *unit == fact.unit);
    facts.sort_by(|x, y| {
        unit(x)
            .cmp(&unit(y))
            .then_with(|| size(y).total_cmp(&size(x)))
    });
    facts
}

/// Makes the counts unknown of a kind of which the other side has an event where this side cannot be computed, and says why, by
/// the name of the count.
fn leave_open(
    on_a: &mut Numbers,
    on_b: &mut Numbers,
    pairs: &[EventPair],
) -> BTreeMap<String, &'static str> {
    let mut open = BTreeMap::new();
    for pair in pairs.iter().filter(|pair| pair.is_open_elsewhere) {
        let (side, why) = match pair.a {
            Some(_) => (
                &mut *on_b,
                word!("B cannot be computed during an event of A"),
            ),
            None => (
                &mut *on_a,
                word!("A cannot be computed during an event of B"),
            ),
        };
        let name = pair.kind.replace('_', " ");
        side.insert(key("events", name.clone()), None);
        let before = open.insert(name.clone(), why);
        if before.is_some_and(|before| before != why) {
            open.insert(
                name,
                word!("neither can be computed during every event of the other"),
            );
        }
    }
    open
}

/// Makes the least OTF unknown of a wheel that leaves the ground on this side as the machine tips, while that is above zero, and
/// says why, by the name of the figure: held to the ground, all wheels share what the tipping machine carries on others.
fn leave_tipped(on_side: &mut Numbers, side: &Side) -> BTreeMap<String, &'static str> {
    let mut tipped = BTreeMap::new();
    let facts = || side.events.iter().filter(|event| event.is_fact());
    let tips = |event: &SideEvent| {
        let kinds = [EventKind::EdgeTipping, EventKind::TipOver];
        kinds.iter().any(|kind| kind.name() == event.kind)
    };
    let lifts = facts().filter(|event| event.kind == EventKind::WheelLift.name());
    for lift in lifts.filter(|lift| facts().any(|event| tips(event) && overlap(lift, event))) {
        let wheel = lift.subject.to_uppercase();
        let is_above = |value: &Option<f64>| value.is_some_and(|least| least > 0.0);
        let least = format!("{LEAST_OTF}, {wheel}");
        let own = on_side.get(&key("N", least.clone()));
        if !own.is_some_and(is_above) {
            continue;
        }
        for (unit, name) in [("N", least), ("-", format!("{LEAST_MARGIN}, {wheel}"))] {
            on_side.insert(key(unit, name.clone()), None);
            tipped.insert(
                name,
                word!("it leaves the ground as the machine tips about an edge: its own OTF does not show that"),
            );
        }
    }
    tipped
}

/// The key of a number.
fn key(unit: &str, name: String) -> (usize, String) {
    let place = UNITS.iter().position(|known| *known == unit);
    (place.unwrap_or(0), name)
}

/// Value by index of the unit and name.
type Numbers = BTreeMap<(usize, String), Option<f64>>;

fn numbers(side: &Side) -> Numbers {
    let summary = &side.summary;
    let mut numbers = Numbers::new();
    let mut add = |unit: &str, name: String, value: Option<f64>| {
        numbers.insert(key(unit, name), value);
    };
    let wheels = summary["wheels"].as_object();
    for (wheel, facts) in wheels.into_iter().flatten() {
        for (key, label) in OF_WHEEL {
            add(
                "N",
                format!("{label}, {}", wheel.to_uppercase()),
                facts[key].as_f64(),
            );
        }
        let margin = facts["least_otf_n"]
            .as_f64()
            .zip(facts["static_load_n"].as_f64());
        let margin = margin
            .map(|(otf, load)| otf / load)
            .filter(|m| m.is_finite());
        add(
            "-",
            format!("{LEAST_MARGIN}, {}", wheel.to_uppercase()),
            margin,
        );
    }
    let rows = &summary["rows"];
    let valid = rows["valid"].as_f64().zip(rows["count"].as_f64());
    add(
        "-",
        message!("valid rows, share").into(),
        valid.map(|(valid, all)| valid / all),
    );
    add("rows", message!("rows").into(), rows["count"].as_f64());
    add(
        "s",
        message!("duration").into(),
        rows["duration_s"].as_f64(),
    );
    let coverage = &summary["coverage"];
    add(
        "-",
        message!("computable time, share").into(),
        coverage["valid_share"].as_f64(),
    );
    add(
        "s",
        message!("time covered by the log").into(),
        coverage["covered_s"].as_f64(),
    );
    let is_computable = coverage["computable_rows"].as_u64() > Some(0);
    add(
        "kg",
        message!("mass of the machine").into(),
        summary["machine"]["largest_mass_kg"].as_f64(),
    );
    // events of the machine are known only where loads are
    let mut counts: BTreeMap<&str, Option<f64>> = BTreeMap::new();
    for kind in EventKind::ALL {
        let is_known = is_computable || !kind.is_stability();
        counts.insert(kind.name(), is_known.then_some(0.0));
    }
    for event in &side.events {
        let count = counts.entry(event.kind.as_str());
        let count = count.or_default();
        *count = Some(count.unwrap_or(0.0) + 1.0);
    }
    for (kind, count) in counts {
        add("events", kind.replace('_', " "), count);
    }
    numbers
}

/// Pairs of events with the same kind and subject that overlap: a long event has one with each of several short ones. Events on
/// one side only come first. Logs that differ tell of each other only where they have rows at the same times.
pub(super) fn events(a: &Side, b: &Side, same_log: bool, has_same_times: bool) -> Vec<EventPair> {
    let is_one_time = same_log || has_same_times;
    let is_same = |event: &SideEvent, other: &SideEvent| is_one_time && is_same(event, other);
    let is_open = |side: &Side, event: &SideEvent| same_log && is_open(side, event);
    let is_only = |side: &Side, event: &SideEvent| match same_log {
        true => !is_open(side, event),
        false => has_same_times && has_rows(side, event),
    };
    let pair = |on_a: Option<&SideEvent>, on_b: Option<&SideEvent>| {
        let event = on_a.or(on_b)?;
        Some(EventPair {
            is_only: (on_b.is_none() && is_only(b, event)) || (on_a.is_none() && is_only(a, event)),
            is_told: true,
            kind: event.kind.clone(),
            subject: event.subject.clone(),
            a: on_a.map(|event| event_side(a, event)),
            b: on_b.map(|event| event_side(b, event)),
            is_open_elsewhere: (on_b.is_none() && is_open(b, event))
                || (on_a.is_none() && is_open(a, event)),
            supposed: None,
        })
    };
    let mut pairs = Vec::new();
    for event in &a.events {
        let of_b = b.events.iter().filter(|other| is_same(event, other));
        pairs.extend(of_b.filter_map(|other| pair(Some(event), Some(other))));
    }
    let is_alone =
        |event: &&SideEvent, other: &Side| !other.events.iter().any(|of| is_same(event, of));
    let only_a = a.events.iter().filter(|event| is_alone(event, b));
    pairs.extend(only_a.filter_map(|event| pair(Some(event), None)));
    let only_b = b.events.iter().filter(|event| is_alone(event, a));
    pairs.extend(only_b.filter_map(|event| pair(None, Some(event))));
    sort(&mut pairs);
    pairs
}

/// Events on one side only come first.
fn sort(pairs: &mut [EventPair]) {
    let start = |pair: &EventPair| {
        pair.a
            .as_ref()
            .or(pair.b.as_ref())
            .map_or(0.0, |e| e.start_s)
    };
    let in_both = |pair: &EventPair| pair.a.is_some() && pair.b.is_some();
    pairs.sort_by(|x, y| {
        in_both(x)
            .cmp(&in_both(y))
            .then_with(|| start(x).total_cmp(&start(y)))
    });
}

/// States of an event of A, by kind, subject and start (s after the first row), whether it would have happened as supposed in B.
/// It has one answer, with however many events of B it overlaps: its first pair has it, and the others of B are B's own.
pub(super) fn answer(
    pairs: &mut Vec<EventPair>,
    (kind, subject): (EventKind, &str),
    start_s: f64,
    reply: &Reply,
) {
    let is_it = |pair: &EventPair| {
        let starts_s = pair.a.as_ref().map(|event| event.start_s);
        pair.kind == kind.name() && pair.subject == subject && starts_s == Some(start_s)
    };
    let mut is_answered = false;
    for pair in pairs.iter_mut().filter(|pair| is_it(pair)) {
        if std::mem::replace(&mut is_answered, true) {
            pair.a = None;
            pair.is_told = false;
        } else {
            pair.supposed = Some(reply.clone());
        }
    }
    // what B has of it beside another event of A, too, is no event of its own
    let with_a: Vec<EventPair> = (pairs.iter().filter(|pair| pair.a.is_some()))
        .cloned()
        .collect();
    pairs.retain(|pair| {
        let is_same =
            |of: &EventPair| (&of.kind, &of.subject, &of.b) == (&pair.kind, &pair.subject, &pair.b);
        pair.is_told || !with_a.iter().any(is_same)
    });
    sort(pairs);
}

fn is_same(a: &SideEvent, b: &SideEvent) -> bool {
    a.kind == b.kind && a.subject == b.subject && overlap(a, b)
}

fn overlap(a: &SideEvent, b: &SideEvent) -> bool {
    let end = |event: &SideEvent| event.end_ns.unwrap_or(i64::MAX);
    a.start_ns <= end(b) && b.start_ns <= end(a)
}

/// Whether a side has rows in the time of an event, and fewer than one in ten is valid.
fn is_open(side: &Side, event: &SideEvent) -> bool {
    let [rows, valid] = rows_during(side, event);
    10 * valid < rows
}

/// Whether a side has rows in the time of an event, and one in ten is valid or more.
fn has_rows(side: &Side, event: &SideEvent) -> bool {
    let [rows, valid] = rows_during(side, event);
    rows > 0 && 10 * valid >= rows
}

/// The rows of a side in the time of an event, and how many of them are valid.
fn rows_during(side: &Side, event: &SideEvent) -> [usize; 2] {
    let before = |time_ns: i64| side.times_ns.partition_point(|&of_row| of_row < time_ns);
    let first = before(event.start_ns);
    let after = event.end_ns.map_or(side.times_ns.len(), |end_ns| {
        before(end_ns.saturating_add(1))
    });
    let rows = &side.valid[first..after.max(first)];
    [rows.len(), rows.iter().filter(|valid| **valid).count()]
}

fn event_side(side: &Side, event: &SideEvent) -> EventSide {
    let first_ns = side.times_ns.first().copied().unwrap_or(event.start_ns);
    let end_ns = event.end_ns;
    EventSide {
        start_s: (event.start_ns - first_ns) as f64 * 1e-9,
        duration_s: end_ns.map(|end_ns| (end_ns - event.start_ns) as f64 * 1e-9),
        worst: event.worst,
        unit: event.unit.clone(),
        certainty: event.certainty,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn side(spans_s: &[[i64; 2]]) -> Side {
        let second = |s: i64| s * 1_000_000_000;
        let event = |&[start_s, end_s]: &[i64; 2]| SideEvent {
            kind: "wheel_light".into(),
            subject: "rl".into(),
            start_ns: second(start_s),
            end_ns: Some(second(end_s)),
            worst: Some(0.0),
            unit: "N".into(),
            certainty: None,
        };
        Side {
            name: String::new(),
            summary: serde_json::Value::Null,
            sources: None,
            times_ns: (0..20).map(second).collect(),
            valid: vec![true; 20],
            columns: Vec::new(),
            events: spans_s.iter().map(event).collect(),
        }
    }

    /// A wheel's own OTF is hidden only by a lift that is a fact, as the machine tips.
    #[test]
    fn a_lift_hides_the_otf_of_its_wheel_only_as_the_machine_tips() {
        let is_hidden = |kind: &str, tips_s: [i64; 2], certainty: f64| {
            let mut of = side(&[[2, 4], tips_s]);
            of.events[0].kind = "wheel_lift".into();
            of.events[0].certainty = Some(certainty);
            of.events[1].kind = kind.into();
            of.events[1].subject = "left".into();
            let name = format!("{LEAST_OTF}, RL");
            let mut numbers = Numbers::from([(key("N", name.clone()), Some(100.0))]);
            let why = leave_tipped(&mut numbers, &of);
            assert_eq!(why.contains_key(&name), numbers[&key("N", name)].is_none());
            !why.is_empty()
        };
        assert!(is_hidden("edge_tipping", [3, 5], 0.9));
        assert!(is_hidden("tip_over", [3, 5], 0.9));
        assert!(!is_hidden("edge_tipping", [3, 5], 0.3));
        assert!(!is_hidden("edge_tipping", [6, 8], 0.9));
        assert!(!is_hidden("wheel_light", [3, 5], 0.9));
    }

    /// Of a crane's foot the same line stood three times.
    #[test]
    fn an_event_with_several_in_b_has_one_answer() {
        let mut pairs = events(
            &side(&[[2, 14], [16, 18]]),
            &side(&[[1, 3], [5, 6], [8, 9], [16, 17]]),
            true,
            true,
        );
        assert_eq!(pairs.len(), 4);
        let reply = Reply::default();
        answer(&mut pairs, (EventKind::WheelLight, "rl"), 2.0, &reply);
        answer(&mut pairs, (EventKind::WheelLight, "rl"), 16.0, &reply);
        let starts_s: Vec<f64> = (pairs.iter())
            .filter(|pair| pair.supposed.is_some())
            .map(|pair| pair.a.as_ref().unwrap().start_s)
            .collect();
        assert_eq!(starts_s, [2.0, 16.0]);
        // the others of B are in the document, as its own
        let others = pairs.iter().filter(|pair| !pair.is_told);
        let starts_s: Vec<f64> = others
            .map(|pair| {
                assert!(pair.a.is_none());
                pair.b.as_ref().unwrap().start_s
            })
            .collect();
        assert_eq!(starts_s, [5.0, 8.0]);
        assert_eq!(pairs.len(), 4);
    }

    #[test]
    fn an_event_of_b_beside_two_that_are_answered_is_not_its_own() {
        let mut pairs = events(
            &side(&[[2, 6], [8, 12]]),
            &side(&[[1, 3], [5, 9]]),
            true,
            true,
        );
        assert_eq!(pairs.len(), 3);
        for start_s in [2.0, 8.0] {
            answer(
                &mut pairs,
                (EventKind::WheelLight, "rl"),
                start_s,
                &Reply::default(),
            );
        }
        assert_eq!(pairs.len(), 2);
        assert!(
            pairs
                .iter()
                .all(|pair| pair.is_told && pair.supposed.is_some())
        );
    }

    /// A copy with other bytes has the same times; of two motions nothing is one event, and neither is open in the other.
    #[test]
    fn events_of_different_logs_are_pairs_only_at_the_same_times() {
        let (a, mut b) = (side(&[[2, 4], [12, 13]]), side(&[[3, 5], [8, 9]]));
        b.valid[10..].fill(false);
        let told = |has_same_times: bool| -> Vec<[bool; 4]> {
            let pairs = events(&a, &b, false, has_same_times);
            let told = |pair: &EventPair| {
                let EventPair {
                    is_only,
                    is_open_elsewhere,
                    ..
                } = *pair;
                [
                    pair.a.is_some(),
                    pair.b.is_some(),
                    is_only,
                    is_open_elsewhere,
                ]
            };
            pairs.iter().map(told).collect()
        };
        let in_b = [false, true, true, false];
        let in_a = [true, false, false, false];
        let in_both = [true, true, false, false];
        assert_eq!(told(true), [in_b, in_a, in_both]);
        let none = told(false);
        assert_eq!(none.len(), 4);
        assert!(
            none.iter()
                .all(|[a, b, is_only, is_open]| a != b && !is_only && !is_open)
        );
    }

    /// What B has all along happens there, too, also where A has it twice.
    #[test]
    fn a_long_event_has_a_pair_with_each_of_several_short_ones() {
        let pairs = events(
            &side(&[[2, 4], [6, 8], [12, 14]]),
            &side(&[[1, 9], [16, 17]]),
            true,
            true,
        );
        let start_s = |side: &Option<EventSide>| side.as_ref().map(|event| event.start_s);
        let starts_s: Vec<_> = pairs
            .iter()
            .map(|pair| (start_s(&pair.a), start_s(&pair.b)))
            .collect();
        assert_eq!(
            starts_s,
            [
                (Some(12.0), None),
                (None, Some(16.0)),
                (Some(2.0), Some(1.0)),
                (Some(6.0), Some(1.0)),
            ]
        );
    }
}
