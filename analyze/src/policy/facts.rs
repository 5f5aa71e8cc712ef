//! Facts: the key figures of an analysis, which policies judge and fleets collect. Names include the
//! unit; values that cannot be computed are `None`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tipwatch_ingest::{Losses, LostRange};
use tipwatch_language::say;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::number::SURE_SIGMAS;

use crate::analysis::calendar::Calendar;
use crate::analysis::digest::WheelDigest;
use crate::analysis::{Analysis, Coverage, Undecided};
use crate::base::built::built;
use crate::base::frame::record;
use crate::base::number::known;
use crate::base::shared::Shared;
use crate::events::{Event, EventKind, Finding, Turning};

pub use crate::analysis::margin::{
    EXPOSURE_CAUSES, Exposure, HISTOGRAM_EDGES, Moment, WorstMargin,
};

/// Number of findings kept.
const MOST_FINDINGS: usize = 3;

built! {
    /// The facts of one log.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct LogFacts: pub fn of(analysis: &Analysis, findings: &[Finding], doubts: Vec<String>) {
        let (rows, losses, margins) = (&analysis.rows, &analysis.losses, &analysis.margins);
        let (start_ns, end_ns) = (rows.times_ns[0], rows.times_ns[rows.len() - 1]);
        let gaps = analysis.events.iter();
        let gaps = gaps.filter(|event| event.kind == EventKind::InputGap);
        let is_valid = |row: &usize| rows.is_valid(*row);
    } {
        /// Time of the first row (ns).
        pub start_ns: i64 = start_ns,
        /// Time of the first row since 1970 (ns, UTC), by the clock that stamped the signals or, where its stamps are no dates, by the
        /// recorder's; `None` if neither tells the date. Absent from results of older versions.
        #[serde(default)]
        pub start_utc_ns: Option<i64> = Calendar::of(analysis).utc_ns(start_ns),
        /// Time of the last row (ns).
        pub end_ns: i64 = end_ns,
        /// Time from the first to the last row (s).
        pub duration_s: f64 = (end_ns - start_ns) as f64 * 1e-9,
        /// Number of rows.
        pub rows: u64 = rows.len() as u64,
        /// Number of valid rows.
        pub valid_rows: u64 = (0..rows.len()).filter(is_valid).count() as u64,
        /// Share of the log's time that could be computed.
        pub coverage: Coverage = analysis.coverage,
        /// Findings about grossly wrong inputs.
        pub gross_inputs: Vec<String> = analysis.gross_inputs_in_words(),
        /// Further doubts about the computed loads, one sentence each: loads that nobody stated, measured loads that contradict
        /// them, inputs that contradict the machine file. Absent from results of older versions.
        #[serde(default)]
        pub doubts: Vec<String> = doubts,
        /// Smallest margin over the valid rows.
        pub worst: Option<WorstMargin> = margins.worst.clone(),
        /// Smallest margin under any split of the load, 0 to 1, over the valid rows: 0 where a wheel was off the ground under
        /// every split. Absent from results of older versions.
        #[serde(default)]
        pub margin_any_split: Option<f64> = match analysis.events.iter().any(lifts_under_any_split) {
            true => Some(0.0),
            false => margins.any_split,
        },
        /// Largest utilisation over the valid rows: U = 1 - (OTF - 2 sigma) / static load, of the worst
        /// wheel. OTF is the overturning force.
        pub largest_utilisation: Option<f64> = margins.largest_utilisation,
        /// Exposure: time by margin, and causes of small margins.
        pub exposure: Exposure = margins.exposure(analysis.coverage.covered_s),
        /// Facts by wheel.
        pub wheels: Vec<WheelFacts> = (analysis.machine.wheels().iter())
            .zip(&analysis.digest.wheels)
            .map(|(wheel, found)| WheelFacts::of(&wheel.name, found))
            .collect(),
        /// Number of events by kind; `None` for events of the machine if no row is computable.
        pub event_counts: EventCounts = BTreeMap::from(EventKind::ALL.map(|kind| (kind, count(analysis, kind)))).into(),
        /// Longest gap in a signal (s); 0 without an `input_gap`.
        pub longest_gap_s: f64 = gaps.map(|event| event.worst).fold(0.0, f64::max),
        /// Number of lost byte ranges.
        pub lost_ranges: u64 = losses.ranges.len() as u64,
        /// Bytes in these ranges.
        pub lost_bytes: u64 = losses.bytes_lost(),
        /// Messages that the recorder counted but the log does not contain; `None` if a part was lost whose
        /// messages nobody counted.
        pub missing_messages: Option<u64> = missing_messages(losses),
        /// Messages that could not be decoded.
        pub undecodable_messages: u64 = losses.undecodable_messages.values().sum(),
        /// The most important findings in words, without their evidence.
        pub findings: Vec<String> =
            findings.iter().take(MOST_FINDINGS).map(|finding| finding.headline.clone()).collect(),
        /// Notes of the analysis.
        pub notes: Vec<Shared<str>> = analysis.notes.iter().map(|note| note.to_string().into()).collect(),
        /// A fall that may have begun when the log ends. Absent from results of older versions.
        #[serde(default)]
        pub open_fall: Option<OpenFall> =
            analysis.turning.as_ref().map(|turning| OpenFall::of(&analysis.machine, turning)),
    }
}

/// Name of a number that a policy may limit, and its value: `None` if it cannot be computed.
pub(super) type Quantity = (&'static str, fn(&LogFacts) -> Option<f64>);

/// All numbers that a policy may limit.
pub(super) const QUANTITIES: [Quantity; 10] = [
    // over the valid rows, smallest OTF as a share of the wheel's static load
    ("worst_margin", |facts| Some(facts.worst.as_ref()?.margin)),
    // the same minus two standard deviations
    ("worst_margin_low", |facts| {
        let worst = facts.worst.as_ref()?;
        Some(worst.margin - SURE_SIGMAS * worst.sigma?)
    }),
    // smallest OTF of the valid rows (N)
    ("least_otf_n", |facts| {
        let otfs = facts.wheels.iter().map(|wheel| wheel.least_otf_n);
        let otfs = otfs.collect::<Option<Vec<f64>>>()?;
        otfs.into_iter().reduce(f64::min)
    }),
    // largest of the valid rows: U = 1 - (OTF - 2 sigma) / static load
    ("utilisation", |facts| facts.largest_utilisation),
    // time with a margin below 1 - the notice level (s)
    ("exposed_s", |facts| facts.exposure.exposed_s),
    // time with known loads over the time that the log covers and the machine was on its wheels
    ("valid_share", |facts| facts.coverage.valid_share),
    // from the first row to the last (s)
    ("duration_s", |facts| Some(facts.duration_s)),
    // longest time without data of a signal (s)
    ("longest_gap_s", |facts| Some(facts.longest_gap_s)),
    // parts of the file that could not be read
    ("lost_ranges", |facts| Some(facts.lost_ranges as f64)),
    // missing or undecodable
    ("lost_messages", |facts| {
        Some((facts.missing_messages? + facts.undecodable_messages) as f64)
    }),
];

/// Number of events of each kind; `None` if it cannot be known. In a record it is a table by kind.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(
    from = "BTreeMap<EventKind, Option<u64>>",
    into = "BTreeMap<EventKind, Option<u64>>"
)]
pub struct EventCounts([Option<u32>; EventKind::ALL.len()]);

impl EventCounts {
    fn of(&self, kind: EventKind) -> Option<u64> {
        self.0[kind as usize].map(u64::from)
    }
}

impl From<BTreeMap<EventKind, Option<u64>>> for EventCounts {
    fn from(counts: BTreeMap<EventKind, Option<u64>>) -> Self {
        Self(EventKind::ALL.map(|kind| {
            let count = counts.get(&kind).copied().flatten()?;
            Some(u32::try_from(count).unwrap_or(u32::MAX))
        }))
    }
}

impl From<EventCounts> for BTreeMap<EventKind, Option<u64>> {
    fn from(counts: EventCounts) -> Self {
        EventKind::ALL.map(|kind| (kind, counts.of(kind))).into()
    }
}

built! {
    /// A fall that may have begun when the log ends.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct OpenFall: fn of(machine: &Machine, turning: &Turning) {} {
        /// The edge.
        pub edge: String = turning.edge.clone(),
        /// The wheels off the edge, in lower case, if the tyres do not explain the rotation with all of them on the ground.
        #[serde(default)]
        pub off_edge: Vec<String> = match turning.is_beyond_tyres {
            true => wheels_off(machine, &turning.edge),
            false => Vec::new(),
        },
        /// Description of the observed rotation.
        pub found: String = say!("the log ends while {}", turning.in_words()),
    }
}

built! {
    /// The facts of a wheel, over the valid rows.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct WheelFacts: fn of(name: &str, found: &WheelDigest) {} {
        /// Its name, in lower case.
        pub name: Shared<str> = name.to_lowercase().into(),
        /// Static load: level, at rest, in the reference posture (N).
        pub static_load_n: Option<f64> = found.static_load_n,
        /// Smallest OTF (N).
        pub least_otf_n: Option<f64> = found.least_otf_n,
        /// Smallest load (N).
        pub least_load_n: Option<f64> = found.least_load_n,
        /// Largest load (N).
        pub largest_load_n: Option<f64> = found.largest_load_n,
    }
}

record! {
    /// The facts of an event of a log that ends at a time (ns); `is_open` is whether it rests on a rotation that ground that gave
    /// way explains as well.
    #[derive(Serialize, Deserialize)]
    pub struct EventFacts of (event: &Event, last_ns: i64, is_open: bool) {
        let cause = event.causes.as_ref().and_then(|causes| causes.shares.first());
        // a measured rotation may last beyond the last row
        let until_ns = event.end_ns.unwrap_or(last_ns.max(event.worst_ns));
    } {
        /// as in [Events](events.md)
        kind: EventKind = event.kind,
        /// the wheel, edge or signal
        subject: Shared<str> = event.subject.as_str().into(),
        /// start
        start_ns: i64 ["ns"] = event.start_ns,
        /// end; null if it lasts until the log ends
        end_ns: Option<i64> ["ns"] = event.end_ns,
        /// how long it lasted, until the log ends if it is still active
        duration_s: f64 ["s"] = (until_ns - event.start_ns).max(0) as f64 * 1e-9,
        /// the worst value
        worst: Option<f64> ["column unit"] = known(event.worst),
        /// unit of `worst`
        unit: Shared<str> = event.unit.into(),
        /// time of the worst value
        worst_ns: i64 ["ns"] = event.worst_ns,
        /// time from the onset of the first `wheel_light` that lasts until the event
        lead_s: Option<f64> ["s"] = event.lead_s,
        /// confidence: probability that the finding is true under the stated split
        certainty: Option<f64> ["-"] = event.certainty,
        /// whether another admissible split of the load would undo it
        split_dependent: Option<bool> = event.split_dependent,
        /// the cause that took most of the load
        main_cause: Option<Shared<str>> = cause.map(|share| share.cause.into()),
        /// its share
        main_cause_percent: Option<f64> ["%"] = cause.and_then(|share| known(share.percent)),
        /// probability that the finding is true under any split
        certainty_any_split: Option<f64> ["-"] = event.certainty_any_split,
        /// standard deviation of the start
        start_sigma_s: Option<f64> ["s"] = event.start_sigma_s,
        /// signals that contradict each other during the event
        doubted_by: Option<Vec<String>> = Some(event.doubt.as_ref().map_or_else(Vec::new, |doubt| doubt.subjects.clone())),
        /// whether gyro and attitude both show it, whatever the loads are
        is_measured: Option<bool> = Some(event.is_measured()),
        /// whether it rests on a rotation that ground that gave way explains as well
        is_open: Option<bool> = Some(is_open),
        /// of an edge, another one that it may be about instead
        other_edge: Option<Shared<str>> = event.other_edge().map(Into::into),
    }
}

/// The wheels that an edge does not carry, in lower case.
fn wheels_off(machine: &Machine, edge: &str) -> Vec<String> {
    let edge = machine.edge_named(edge).into_iter();
    edge.flat_map(|edge| machine.polygon().edges()[edge].off())
        .map(|wheel| machine.wheels()[wheel].name.to_lowercase())
        .collect()
}

impl LogFacts {
    /// Number of events of a kind; `None` if it cannot be known.
    #[must_use]
    pub fn events_of(&self, kind: EventKind) -> Option<u64> {
        self.event_counts.of(kind)
    }

    /// Whether there is an event of a kind.
    #[must_use]
    pub fn has_event(&self, kind: EventKind) -> bool {
        self.events_of(kind).is_some_and(|count| count > 0)
    }

    /// Returns the reason why the log decides nothing; `None` if it decides. At least `min_valid` of its time must be computable.
    #[must_use]
    pub fn undecided(&self, min_valid: f64) -> Option<Undecided> {
        Undecided::of(&self.coverage, &self.gross_inputs, min_valid)
    }

    /// Whether data of the log was lost.
    #[must_use]
    pub fn has_losses(&self) -> bool {
        self.lost_ranges > 0
            || self.missing_messages.is_none_or(|count| count > 0)
            || self.undecodable_messages > 0
    }

    /// Whether the log deserves a report: a stability event, or an OTF within two standard deviations of
    /// zero.
    #[must_use]
    pub fn has_findings(&self) -> bool {
        let mut stability = EventKind::ALL.iter().filter(|kind| kind.is_stability());
        stability.any(|&kind| self.has_event(kind))
            || self.largest_utilisation.is_some_and(|u| u >= 1.0)
    }
}

impl EventFacts {
    /// Whether the event is more probable than not, and no ground that gave way explains it as well.
    #[must_use]
    pub fn is_fact(&self) -> bool {
        let is_probable = |certainty: f64| certainty >= super::LEAST_OF_A_FACT;
        self.certainty.is_none_or(is_probable) && self.is_open != Some(true)
    }
}

/// Whether a wheel was off the ground however the load is split. Rows of a tipping machine, which show it best, are not valid.
fn lifts_under_any_split(event: &Event) -> bool {
    let certainty = event.certainty_any_split;
    event.kind == EventKind::WheelLift
        && certainty.is_some_and(|certainty| certainty >= super::LEAST_OF_A_FACT)
}

/// The facts of all events of an analysis.
#[must_use]
pub fn event_facts(analysis: &Analysis) -> Vec<EventFacts> {
    let rows = &analysis.rows;
    let last_ns = rows.times_ns[rows.len() - 1];
    let open: Vec<&Event> = analysis
        .events
        .iter()
        .filter(|event| event.is_open())
        .collect();
    let is_open = |event: &Event| {
        // what the loads show by themselves is more certain than that
        let rests_on_it = event
            .certainty
            .is_some_and(|certainty| certainty < super::LEAST_OF_A_FACT);
        let mut open = open.iter();
        event.kind.is_observed() && rests_on_it && open.any(|it| it.overlaps(event.span_ns()))
    };
    let events = analysis.events.iter();
    let facts = events.map(|event| EventFacts::of(event, last_ns, is_open(event)));
    facts.collect()
}

/// Counts the events of a kind; `None` if there are none of the machine and no loads are known that would exclude them.
fn count(analysis: &Analysis, kind: EventKind) -> Option<u64> {
    let events = analysis.events.iter();
    let count = events.filter(|event| event.kind == kind).count() as u64;
    (count > 0 || analysis.coverage.computable_rows > 0 || !kind.is_stability()).then_some(count)
}

fn missing_messages(losses: &Losses) -> Option<u64> {
    let is_counted = |range: &LostRange| range.message_count.is_some();
    let missing = losses.missing_messages.values();
    losses.ranges.iter().all(is_counted).then(|| missing.sum())
}
