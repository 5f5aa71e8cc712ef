//! Facts: the key figures of an analysis, which policies judge and fleets collect. Names include the
//! unit; values that cannot be computed are `None`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tipwatch_ingest::{Losses, LostRange};
use tipwatch_language::say;
use tipwatch_mechanics::machine::Machine;

use crate::analysis::calendar::Calendar;
use crate::analysis::{Analysis, Coverage, Undecided};
use crate::base::number::known;
use crate::base::shared::Shared;
use crate::events::{Event, EventKind, Finding};
use crate::tables::frame::record;

pub use crate::analysis::margin::{
    EXPOSURE_CAUSES, Exposure, HISTOGRAM_EDGES, Moment, WorstMargin,
};

/// Number of findings kept.
const MOST_FINDINGS: usize = 3;

/// The facts of one log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LogFacts {
    /// Time of the first row (ns).
    pub start_ns: i64,
    /// Time of the first row since 1970 (ns, UTC), by the clock that stamped the signals or, where its stamps are no dates, by the
    /// recorder's; `None` if neither tells the date. Absent from results of older versions.
    #[serde(default)]
    pub start_utc_ns: Option<i64>,
    /// Time of the last row (ns).
    pub end_ns: i64,
    /// Time from the first to the last row (s).
    pub duration_s: f64,
    /// Number of rows.
    pub rows: u64,
    /// Number of valid rows.
    pub valid_rows: u64,
    /// Share of the log's time that could be computed.
    pub coverage: Coverage,
    /// Findings about grossly wrong inputs.
    pub gross_inputs: Vec<String>,
    /// Further doubts about the computed loads, one sentence each: loads that nobody stated, measured loads that contradict
    /// them, inputs that contradict the machine file. Absent from results of older versions.
    #[serde(default)]
    pub doubts: Vec<String>,
    /// Smallest margin over the valid rows.
    pub worst: Option<WorstMargin>,
    /// Smallest margin under any split of the load, 0 to 1, over the valid rows: 0 where a wheel was off the ground under
    /// every split. Absent from results of older versions.
    #[serde(default)]
    pub margin_any_split: Option<f64>,
    /// Largest utilisation over the valid rows: U = 1 - (OTF - 2 sigma) / static load, of the worst
    /// wheel. OTF is the overturning force.
    pub largest_utilisation: Option<f64>,
    /// Exposure: time by margin, and causes of small margins.
    pub exposure: Exposure,
    /// Facts by wheel.
    pub wheels: Vec<WheelFacts>,
    /// Number of events by kind; `None` for events of the machine if no row is computable.
    pub event_counts: EventCounts,
    /// Longest gap in a signal (s); 0 without an `input_gap`.
    pub longest_gap_s: f64,
    /// Number of lost byte ranges.
    pub lost_ranges: u64,
    /// Bytes in these ranges.
    pub lost_bytes: u64,
    /// Messages that the recorder counted but the log does not contain; `None` if a part was lost whose
    /// messages nobody counted.
    pub missing_messages: Option<u64>,
    /// Messages that could not be decoded.
    pub undecodable_messages: u64,
    /// The most important findings in words, without their evidence.
    pub findings: Vec<String>,
    /// Notes of the analysis.
    pub notes: Vec<Shared<str>>,
    /// A fall that may have begun when the log ends. Absent from results of older versions.
    #[serde(default)]
    pub open_fall: Option<OpenFall>,
}

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

/// A fall that may have begun when the log ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OpenFall {
    /// The edge.
    pub edge: String,
    /// The wheels off the edge, in lower case, if the tyres do not explain the rotation with all of them on the ground.
    #[serde(default)]
    pub off_edge: Vec<String>,
    /// Description of the observed rotation.
    pub found: String,
}

/// The facts of a wheel, over the valid rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WheelFacts {
    /// Its name, in lower case.
    pub name: Shared<str>,
    /// Static load: level, at rest, in the reference posture (N).
    pub static_load_n: Option<f64>,
    /// Smallest OTF (N).
    pub least_otf_n: Option<f64>,
    /// Smallest load (N).
    pub least_load_n: Option<f64>,
    /// Largest load (N).
    pub largest_load_n: Option<f64>,
}

record! {
    /// The facts of an event.
    #[derive(Serialize, Deserialize)]
    pub struct EventFacts {
        /// as in [Events](events.md)
        kind: EventKind,
        /// the wheel, edge or signal
        subject: Shared<str>,
        /// start
        start_ns: i64 ["ns"],
        /// end; null if it lasts until the log ends
        end_ns: Option<i64> ["ns"],
        /// how long it lasted, until the log ends if it is still active
        duration_s: f64 ["s"],
        /// the worst value
        worst: Option<f64> ["column unit"],
        /// unit of `worst`
        unit: Shared<str>,
        /// time of the worst value
        worst_ns: i64 ["ns"],
        /// time from the onset of the first `wheel_light` that lasts until the event
        lead_s: Option<f64> ["s"],
        /// confidence: probability that the finding is true under the stated split
        certainty: Option<f64> ["-"],
        /// whether another admissible split of the load would undo it
        split_dependent: Option<bool>,
        /// the cause that took most of the load
        main_cause: Option<Shared<str>>,
        /// its share
        main_cause_percent: Option<f64> ["%"],
        /// probability that the finding is true under any split
        certainty_any_split: Option<f64> ["-"],
        /// standard deviation of the start
        start_sigma_s: Option<f64> ["s"],
        /// signals that contradict each other during the event
        doubted_by: Option<Vec<String>>,
        /// whether gyro and attitude both show it, whatever the loads are
        is_measured: Option<bool>,
        /// whether it rests on a rotation that ground that gave way explains as well
        is_open: Option<bool>,
        /// of an edge, another one that it may be about instead
        other_edge: Option<Shared<str>>,
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
    /// The facts of an analysis, the headlines of its findings, and what casts doubt on it.
    #[must_use]
    pub fn of(analysis: &Analysis, findings: &[Finding], doubts: Vec<String>) -> Self {
        let rows = &analysis.rows;
        let (start_ns, end_ns) = (rows.times_ns[0], rows.times_ns[rows.len() - 1]);
        let losses = &analysis.losses;
        let gaps = analysis.events.iter();
        let gaps = gaps.filter(|event| event.kind == EventKind::InputGap);
        Self {
            start_ns,
            start_utc_ns: Calendar::of(analysis).utc_ns(start_ns),
            end_ns,
            duration_s: (end_ns - start_ns) as f64 * 1e-9,
            rows: rows.len() as u64,
            valid_rows: (0..rows.len()).filter(|&row| rows.is_valid(row)).count() as u64,
            coverage: analysis.coverage,
            gross_inputs: analysis.gross_inputs_in_words(),
            doubts,
            worst: analysis.margins.worst.clone(),
            margin_any_split: match analysis.events.iter().any(lifts_under_any_split) {
                true => Some(0.0),
                false => analysis.margins.any_split,
            },
            largest_utilisation: analysis.margins.largest_utilisation,
            exposure: (analysis.margins).exposure(analysis.coverage.covered_s),
            wheels: (0..analysis.machine.wheels().len())
                .map(|wheel| wheel_facts(analysis, wheel))
                .collect(),
            event_counts: BTreeMap::from(EventKind::ALL.map(|kind| (kind, count(analysis, kind))))
                .into(),
            longest_gap_s: gaps.map(|event| event.worst).fold(0.0, f64::max),
            lost_ranges: losses.ranges.len() as u64,
            lost_bytes: losses.bytes_lost(),
            missing_messages: missing_messages(losses),
            undecodable_messages: losses.undecodable_messages.values().sum(),
            findings: (findings.iter().take(MOST_FINDINGS))
                .map(|finding| finding.headline.clone())
                .collect(),
            notes: (analysis.notes.iter())
                .map(|note| note.to_string().into())
                .collect(),
            open_fall: (analysis.turning.as_ref()).map(|turning| OpenFall {
                edge: turning.edge.clone(),
                off_edge: match turning.is_beyond_tyres {
                    true => wheels_off(&analysis.machine, &turning.edge),
                    false => Vec::new(),
                },
                found: say!("the log ends while {}", turning.in_words()),
            }),
        }
    }

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
    let facts = analysis.events.iter().map(|event| {
        let cause = event
            .causes
            .as_ref()
            .and_then(|causes| causes.shares.first());
        EventFacts {
            kind: event.kind,
            subject: event.subject.as_str().into(),
            start_ns: event.start_ns,
            end_ns: event.end_ns,
            // a measured rotation may last beyond the last row
            duration_s: (event.end_ns.unwrap_or(last_ns.max(event.worst_ns)) - event.start_ns)
                .max(0) as f64
                * 1e-9,
            worst: known(event.worst),
            unit: event.unit.into(),
            worst_ns: event.worst_ns,
            lead_s: event.lead_s,
            certainty: event.certainty,
            certainty_any_split: event.certainty_any_split,
            start_sigma_s: event.start_sigma_s,
            split_dependent: event.split_dependent,
            main_cause: cause.map(|share| share.cause.into()),
            main_cause_percent: cause.and_then(|share| known(share.percent)),
            doubted_by: Some(
                (event.doubt.as_ref()).map_or_else(Vec::new, |doubt| doubt.subjects.clone()),
            ),
            is_measured: Some(event.is_measured()),
            is_open: Some(is_open(event)),
            other_edge: event.other_edge().map(Into::into),
        }
    });
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

fn wheel_facts(analysis: &Analysis, wheel: usize) -> WheelFacts {
    let found = &analysis.digest.wheels[wheel];
    WheelFacts {
        name: analysis.machine.wheels()[wheel].name.to_lowercase().into(),
        static_load_n: found.static_load_n,
        least_otf_n: found.least_otf_n,
        least_load_n: found.least_load_n,
        largest_load_n: found.largest_load_n,
    }
}
