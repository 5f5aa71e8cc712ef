//! Differences of the summaries: events and figures of the whole log.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::{Serialize, Serializer};
use tipwatch_language::{decimals, message, say, told, word};

use super::side::{Side, SideEvent, event_in_words};
use crate::base::built::built;
use crate::base::number::{known, number, readable};
use crate::events::support_words::support_word;
use crate::events::{Bound, Event, EventKind, EventTimes, Reply};

/// Name of a figure of the whole log. In documents "least OTF, FL".
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Figure {
    label: &'static str,
    /// The wheel that it is of.
    wheel: Option<String>,
}

impl Figure {
    fn of_log(label: &'static str) -> Self {
        Self { label, wheel: None }
    }

    fn of_wheel(label: &'static str, wheel: &str) -> Self {
        Self {
            label,
            wheel: Some(support_word(wheel)),
        }
    }

    /// As a reader reads it.
    pub(super) fn in_words(&self) -> String {
        match &self.wheel {
            Some(wheel) => format!("{}, {wheel}", told(self.label)),
            None => readable(self.label),
        }
    }
}

impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.wheel {
            Some(wheel) => write!(f, "{}, {wheel}", self.label),
            None => f.write_str(&self.label.replace('_', " ")),
        }
    }
}

impl Serialize for Figure {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(self)
    }
}

built! {
    /// A figure of the whole log on both sides.
    #[derive(Debug, Clone, PartialEq, Serialize)]
    pub struct FactDifference: fn of(key: &(usize, Figure), sides: [&Numbers; 2], why_not: Option<&'static str>) {
        let [a, b] = sides.map(|side| side.get(key).copied().flatten());
    } {
        /// Which figure.
        pub name: Figure = key.1.clone(),
        /// Its unit; "-" for a share, "events" for a count.
        pub unit: &'static str = UNITS[key.0],
        /// Value on side A; null if not computable or not applicable.
        pub a: Option<f64> = a,
        /// Value on side B.
        pub b: Option<f64> = b,
        /// B minus A.
        pub difference: Option<f64> = a.zip(b).map(|(a, b)| b - a),
        /// Reason why the count of events of a side is null although the other side has one, or a figure although it could be
        /// computed.
        pub why_not: Option<&'static str> = why_not,
    }
}

impl FactDifference {
    /// Whether the figure differs between the sides.
    pub(super) fn differs(&self) -> bool {
        self.a != self.b
    }

    /// Whether the figure is the least OTF of a wheel.
    pub(super) fn is_least_otf(&self) -> bool {
        self.name.label == LEAST_OTF
    }
}

/// An event on one side or on both.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EventPair {
    /// Kind of the event.
    pub kind: EventKind,
    /// Wheel, edge or signal.
    pub subject: String,
    /// On side A.
    pub a: Option<EventSide>,
    /// On side B.
    pub b: Option<EventSide>,
    /// Evidence of the side without the event. In documents, whether that is [`Elsewhere::Open`].
    #[serde(rename = "is_open_elsewhere")]
    pub elsewhere: Elsewhere,
    /// Whether another pair has the event of A that this event of B overlaps: readers see that one alone.
    #[serde(skip)]
    pub is_repeated: bool,
    /// Whether the event of A would have happened as supposed in B; null where nothing is supposed.
    pub supposed: Option<Reply>,
}

/// Evidence of a side on an event that the other one has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Elsewhere {
    /// The side has the event, too.
    There,
    /// The side has rows in the time of the event, and no event.
    Absent,
    /// The side has rows in the time of the event, of which fewer than one in ten is valid: the event may or may not be there,
    /// too.
    Open,
    /// Nothing: it has no rows in its time, or the logs say nothing of each other.
    Unknown,
}

impl Serialize for Elsewhere {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_bool(*self == Self::Open)
    }
}

impl EventPair {
    /// Describes the event: what happened, and to what.
    pub(super) fn what(&self) -> String {
        event_in_words(self.kind, &self.subject)
    }

    /// Returns the answer whether the event would have happened as supposed in B.
    pub(super) fn answer(&self) -> Option<String> {
        let reply = self.supposed.as_ref()?;
        Some(reply.in_words().unwrap_or_else(|| {
            let why = told(reply.why_not.unwrap_or(message!("the reason is unknown")));
            say!("open ({why})")
        }))
    }
}

built! {
    /// An event of one side.
    #[derive(Debug, Clone, PartialEq, Serialize)]
    pub struct EventSide: fn of(times: EventTimes, of: &SideEvent) {
        let SideEvent { event, unit, .. } = of;
        let lasted_ns = event.end_ns.map(|end_ns| end_ns - event.start_ns);
    } {
        /// Start (s after the first row of A, or, of a log without the times of A, after its own).
        pub start_s: f64 = times.seconds(event.start_ns),
        /// Standard deviation of the start (s); null where no onset was found or without uncertainties.
        pub start_sigma_s: Option<f64> = event.start_sigma_s,
        /// Whether the event began then, or may have begun earlier.
        pub start_bound: Bound = event.start_bound,
        /// Duration (s); null if still active when the log ends.
        pub duration_s: Option<f64> = lasted_ns.map(|ns| ns as f64 * 1e-9),
        /// Whether the event ended then, or may have gone on.
        pub end_bound: Bound = event.end_bound,
        /// Time of the event in words, for a reader.
        #[serde(skip)]
        pub(super) told: String = times.told(event),
        /// The worst value.
        pub worst: Option<f64> = known(event.worst),
        /// Its unit.
        pub unit: String = unit.clone(),
        /// Confidence: probability that it is true.
        pub certainty: Option<f64> = event.certainty,
    }
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

/// Figures of the log: unit, label, place in the summary.
const OF_LOG: [(&str, &str, &str); 5] = [
    ("rows", message!("rows"), "/rows/count"),
    ("s", message!("duration"), "/rows/duration_s"),
    (
        "-",
        message!("computable time, share"),
        "/coverage/valid_share",
    ),
    (
        "s",
        message!("time covered by the log"),
        "/coverage/covered_s",
    ),
    (
        "kg",
        message!("mass of the machine"),
        "/machine/largest_mass_kg",
    ),
];

/// All figures, grouped by unit, the largest difference first; those on one side only come last.
pub(super) fn facts(a: &Side, b: &Side, pairs: &[EventPair]) -> Vec<FactDifference> {
    let (mut on_a, mut on_b) = (numbers(a), numbers(b));
    let mut open = leave_open(&mut on_a, &mut on_b, pairs);
    open.extend(leave_tipped(&mut on_a, a));
    open.extend(leave_tipped(&mut on_b, b));
    let names: BTreeSet<_> = on_a.keys().chain(on_b.keys()).collect();
    let fact =
        |key: &(usize, Figure)| FactDifference::of(key, [&on_a, &on_b], open.get(&key.1).copied());
    let mut facts: Vec<FactDifference> = names.into_iter().map(fact).collect();
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
) -> BTreeMap<Figure, &'static str> {
    let mut open = BTreeMap::new();
    for pair in pairs
        .iter()
        .filter(|pair| pair.elsewhere == Elsewhere::Open)
    {
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
        let name = Figure::of_log(pair.kind.name());
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
fn leave_tipped(on_side: &mut Numbers, side: &Side) -> BTreeMap<Figure, &'static str> {
    let mut tipped = BTreeMap::new();
    let events = || side.events.iter().map(|of| &of.event);
    let facts = || events().filter(|event| event.is_fact());
    let tips = |event: &Event| matches!(event.kind, EventKind::EdgeTipping | EventKind::TipOver);
    let tips_during = |lift: &Event| facts().any(|it| tips(it) && it.overlaps(lift.span_ns()));
    let lifts = facts().filter(|event| event.kind == EventKind::WheelLift);
    for lift in lifts.filter(|lift| tips_during(lift)) {
        let is_above = |value: &Option<f64>| value.is_some_and(|least| least > 0.0);
        let least = Figure::of_wheel(LEAST_OTF, &lift.subject);
        let own = on_side.get(&key("N", least.clone()));
        if !own.is_some_and(is_above) {
            continue;
        }
        let margin = Figure::of_wheel(LEAST_MARGIN, &lift.subject);
        for (unit, name) in [("N", least), ("-", margin)] {
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
fn key(unit: &str, name: Figure) -> (usize, Figure) {
    let place = UNITS.iter().position(|known| *known == unit);
    (place.unwrap_or(0), name)
}

/// Value by index of the unit and figure.
type Numbers = BTreeMap<(usize, Figure), Option<f64>>;

fn numbers(side: &Side) -> Numbers {
    let summary = &side.summary;
    let mut numbers = Numbers::new();
    let mut add = |unit: &str, figure: Figure, value: Option<f64>| {
        numbers.insert(key(unit, figure), value);
    };
    let wheels = summary["wheels"].as_object();
    for (wheel, facts) in wheels.into_iter().flatten() {
        for (key, label) in OF_WHEEL {
            add("N", Figure::of_wheel(label, wheel), facts[key].as_f64());
        }
        let margin = facts["least_otf_n"]
            .as_f64()
            .zip(facts["static_load_n"].as_f64());
        let margin = margin
            .map(|(otf, load)| otf / load)
            .filter(|m| m.is_finite());
        add("-", Figure::of_wheel(LEAST_MARGIN, wheel), margin);
    }
    for (unit, label, place) in OF_LOG {
        let value = summary.pointer(place).and_then(serde_json::Value::as_f64);
        add(unit, Figure::of_log(label), value);
    }
    let rows = &summary["rows"];
    let valid = rows["valid"].as_f64().zip(rows["count"].as_f64());
    let share = valid.map(|(valid, all)| valid / all);
    add("-", Figure::of_log(message!("valid rows, share")), share);
    // events of the machine are known only where loads are
    let is_computable = summary["coverage"]["computable_rows"].as_u64() > Some(0);
    for kind in EventKind::ALL {
        let is_of_kind = |of: &&SideEvent| of.event.kind == kind;
        let count = || side.events.iter().filter(is_of_kind).count();
        let is_known = is_computable || !kind.is_stability() || count() > 0;
        let value = is_known.then(|| count() as f64);
        add("events", Figure::of_log(kind.name()), value);
    }
    numbers
}

/// Pairs of events with the same kind and subject that overlap: a long event has one with each of several short ones. Events on
/// one side only come first. Logs that differ tell of each other only where they have rows at the same times.
pub(super) fn events(a: &Side, b: &Side, same_log: bool, has_same_times: bool) -> Vec<EventPair> {
    let is_one_clock = same_log || has_same_times;
    let is_same =
        |event: &SideEvent, other: &SideEvent| is_one_clock && is_same(&event.event, &other.event);
    let without = |side: &Side, of: &SideEvent| {
        let [rows, valid] = rows_during(side, &of.event);
        let is_computed = rows > 0 && 10 * valid >= rows;
        match is_computed {
            true if is_one_clock => Elsewhere::Absent,
            false if same_log && rows > 0 => Elsewhere::Open,
            _ => Elsewhere::Unknown,
        }
    };
    let zero_b = if is_one_clock { a } else { b };
    let (times_a, times_b) = (a.times(a.first_ns()), b.times(zero_b.first_ns()));
    let pair = |on_a: Option<&SideEvent>, on_b: Option<&SideEvent>| {
        let of = &on_a.or(on_b)?.event;
        Some(EventPair {
            kind: of.kind,
            subject: of.subject.clone(),
            a: on_a.map(|event| EventSide::of(times_a, event)),
            b: on_b.map(|event| EventSide::of(times_b, event)),
            elsewhere: match (on_a, on_b) {
                (Some(event), None) => without(b, event),
                (None, Some(event)) => without(a, event),
                _ => Elsewhere::There,
            },
            is_repeated: false,
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

/// Adds the answer for an event of A, by kind, subject and start (s after the first row): whether it would have happened as
/// supposed in B. An event has one answer, with however many events of B it overlaps: its first pair has the answer, and the
/// others of B are B's own.
pub(super) fn answer(
    pairs: &mut Vec<EventPair>,
    (kind, subject): (EventKind, &str),
    start_s: f64,
    reply: &Reply,
) {
    let is_it = |pair: &EventPair| {
        let starts_s = pair.a.as_ref().map(|event| event.start_s);
        pair.kind == kind && pair.subject == subject && starts_s == Some(start_s)
    };
    let mut is_answered = false;
    for pair in pairs.iter_mut().filter(|pair| is_it(pair)) {
        if std::mem::replace(&mut is_answered, true) {
            pair.a = None;
            pair.is_repeated = true;
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
        !pair.is_repeated || !with_a.iter().any(is_same)
    });
    sort(pairs);
}

fn is_same(a: &Event, b: &Event) -> bool {
    a.kind == b.kind && a.subject == b.subject && a.overlaps(b.span_ns())
}

/// The rows of a side in the time of an event, and how many of them are valid.
fn rows_during(side: &Side, event: &Event) -> [usize; 2] {
    let before = |time_ns: i64| side.times_ns.partition_point(|&of_row| of_row < time_ns);
    let first = before(event.start_ns);
    let after = event.end_ns.map_or(side.times_ns.len(), |end_ns| {
        before(end_ns.saturating_add(1))
    });
    let rows = &side.valid[first..after.max(first)];
    [rows.len(), rows.iter().filter(|valid| **valid).count()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn side(spans_s: &[[i64; 2]]) -> Side {
        let second = |s: i64| s * 1_000_000_000;
        let event = |&[start_s, end_s]: &[i64; 2]| SideEvent {
            event: Event {
                end_ns: Some(second(end_s)),
                ..Event::blank(EventKind::WheelLight, second(start_s), "rl".into())
            },
            unit: "N".into(),
            is_qualified: false,
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
        let is_hidden = |kind: EventKind, tips_s: [i64; 2], certainty: f64| {
            let mut of = side(&[[2, 4], tips_s]);
            let [lift, tipping] = &mut of.events[..] else {
                panic!("expected two events");
            };
            lift.event.kind = EventKind::WheelLift;
            lift.event.certainty = Some(certainty);
            tipping.event.kind = kind;
            tipping.event.subject = "left".into();
            let name = Figure::of_wheel(LEAST_OTF, "rl");
            let mut numbers = Numbers::from([(key("N", name.clone()), Some(100.0))]);
            let why = leave_tipped(&mut numbers, &of);
            assert_eq!(why.contains_key(&name), numbers[&key("N", name)].is_none());
            !why.is_empty()
        };
        assert!(is_hidden(EventKind::EdgeTipping, [3, 5], 0.9));
        assert!(is_hidden(EventKind::TipOver, [3, 5], 0.9));
        assert!(!is_hidden(EventKind::EdgeTipping, [3, 5], 0.3));
        assert!(!is_hidden(EventKind::EdgeTipping, [6, 8], 0.9));
        assert!(!is_hidden(EventKind::WheelLight, [3, 5], 0.9));
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
        let others = pairs.iter().filter(|pair| pair.is_repeated);
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
                .all(|pair| !pair.is_repeated && pair.supposed.is_some())
        );
    }

    /// A copy with other bytes has the same times; of two motions nothing is one event, and neither is open in the other.
    #[test]
    fn events_of_different_logs_are_pairs_only_at_the_same_times() {
        let (a, mut b) = (side(&[[2, 4], [12, 13]]), side(&[[3, 5], [8, 9]]));
        b.valid[10..].fill(false);
        let told = |has_same_times: bool| -> Vec<(bool, bool, Elsewhere)> {
            let pairs = events(&a, &b, false, has_same_times);
            let told = |pair: &EventPair| (pair.a.is_some(), pair.b.is_some(), pair.elsewhere);
            pairs.iter().map(told).collect()
        };
        let in_b = (false, true, Elsewhere::Absent);
        let in_a = (true, false, Elsewhere::Unknown);
        let in_both = (true, true, Elsewhere::There);
        assert_eq!(told(true), [in_b, in_a, in_both]);
        let none = told(false);
        assert_eq!(none.len(), 4);
        assert!(
            none.iter()
                .all(|(a, b, elsewhere)| a != b && *elsewhere == Elsewhere::Unknown)
        );
    }

    /// One fall, of which B is the end alone: its times were 4.9 s less than those of A, each from its own first row.
    #[test]
    fn results_of_one_clock_count_from_the_first_row_of_a() {
        let (a, mut b) = (side(&[[1, 2], [6, 9]]), side(&[[6, 9]]));
        b.times_ns.drain(..5);
        b.valid.drain(..5);
        let starts_s = |pairs: &[EventPair]| -> Vec<[Option<f64>; 2]> {
            let start_s = |side: &Option<EventSide>| side.as_ref().map(|event| event.start_s);
            let starts = pairs.iter().map(|pair| [&pair.a, &pair.b].map(start_s));
            starts.collect()
        };
        let pairs = events(&a, &b, true, false);
        assert_eq!(
            starts_s(&pairs),
            [[Some(1.0), None], [Some(6.0), Some(6.0)]]
        );
        // B has no row at the time of the first: it is not only in A
        assert_eq!(pairs[0].elsewhere, Elsewhere::Unknown);
        let [told_a, told_b] =
            [&pairs[1].a, &pairs[1].b].map(|of| of.as_ref().unwrap().told.clone());
        assert_eq!(told_a, told_b);
        // of logs without a clock in common each has its own
        let pairs = events(&a, &b, false, false);
        assert_eq!(
            starts_s(&pairs),
            [[Some(1.0), None], [None, Some(1.0)], [Some(6.0), None]]
        );
    }

    /// Several events of A within one long event of B each pair with it.
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
