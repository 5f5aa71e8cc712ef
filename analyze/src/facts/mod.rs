//! What the analysis of a log comes to, in few numbers: what policies judge, screens collect and
//! comparisons compare. Every number has its unit in its name; what cannot be computed is `None`.

mod margin;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tipwatch_mechanics::Quantity;

use crate::analysis::Analysis;
use crate::events::{Event, EventKind};
use crate::report;

pub use margin::{EXPOSURE_CAUSES, Exposure, HISTOGRAM_EDGES, WorstMargin};

/// Findings in words that are kept.
const MOST_FINDINGS: usize = 3;

/// The facts of one log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LogFacts {
    /// Time of the first row (ns).
    pub start_ns: i64,
    /// Time of the last row (ns).
    pub end_ns: i64,
    /// From the first to the last row (s).
    pub duration_s: f64,
    /// How many rows there are.
    pub rows: u64,
    /// How many of them are valid.
    pub valid_rows: u64,
    /// The smallest margin of the valid rows.
    pub worst: Option<WorstMargin>,
    /// Largest utilisation of the valid rows, U = 1 - (OTF - 2 sigma) / static load of the worst wheel.
    pub largest_utilisation: Option<f64>,
    /// How long the margin was how large, and why it was small.
    pub exposure: Exposure,
    /// By wheel.
    pub wheels: Vec<WheelFacts>,
    /// How many events there are, by [`EventKind::name`].
    pub event_counts: BTreeMap<String, u64>,
    /// Longest time without samples of a signal (s); 0 without an `input_gap`.
    pub longest_gap_s: f64,
    /// Ranges of bytes that were lost.
    pub lost_ranges: u64,
    /// Bytes in them.
    pub lost_bytes: u64,
    /// Messages that the recorder counts and that did not come.
    pub missing_messages: u64,
    /// Messages that could not be decoded.
    pub undecodable_messages: u64,
    /// The most important findings in words, without their evidence.
    pub findings: Vec<String>,
    /// What a reader must know.
    pub notes: Vec<String>,
}

/// The facts of a wheel, over the valid rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WheelFacts {
    /// Its name, in lower case.
    pub name: String,
    /// Level, at rest, in the posture of the first valid row (N).
    pub static_load_n: Option<f64>,
    /// Smallest signed load (N).
    pub least_otf_n: Option<f64>,
    /// Smallest load (N).
    pub least_load_n: Option<f64>,
    /// Largest load (N).
    pub largest_load_n: Option<f64>,
}

/// The facts of an event.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EventFacts {
    /// [`EventKind::name`].
    pub kind: String,
    /// Wheel, edge or signal.
    pub subject: String,
    /// When it begins (ns).
    pub start_ns: i64,
    /// When it ends (ns); `None` if it lasts to the end of the log.
    pub end_ns: Option<i64>,
    /// How long it lasts, to the end of the log where it is open (s).
    pub duration_s: f64,
    /// The worst value.
    pub worst: Option<f64>,
    /// Its unit.
    pub unit: String,
    /// When it was worst (ns).
    pub worst_ns: i64,
    /// Time from the first light wheel to this (s).
    pub lead_s: Option<f64>,
    /// Probability that the finding is true.
    pub certainty: Option<f64>,
    /// Whether another split of the loads would undo it.
    pub split_dependent: Option<bool>,
    /// The cause that took most of the load.
    pub main_cause: Option<String>,
    /// Its share of what was lost (%).
    pub main_cause_percent: Option<f64>,
}

impl LogFacts {
    /// The facts of an analysis.
    #[must_use]
    pub fn of(analysis: &Analysis) -> Self {
        let rows = &analysis.rows;
        let (start_ns, end_ns) = (rows.times_ns[0], rows.times_ns[rows.len() - 1]);
        let losses = &analysis.losses;
        let gaps = analysis.events.iter();
        let gaps = gaps.filter(|event| event.kind == EventKind::InputGap);
        let findings = report::findings(analysis).into_iter();
        let findings = findings.map(|finding| finding.headline).take(MOST_FINDINGS);
        Self {
            start_ns,
            end_ns,
            duration_s: (end_ns - start_ns) as f64 * 1e-9,
            rows: rows.len() as u64,
            valid_rows: (0..rows.len()).filter(|&row| rows.is_valid(row)).count() as u64,
            worst: margin::worst(analysis),
            largest_utilisation: margin::largest_utilisation(analysis),
            exposure: margin::exposure(analysis),
            wheels: (0..analysis.machine.wheels().len())
                .map(|wheel| wheel_facts(analysis, wheel))
                .collect(),
            event_counts: (EventKind::all().iter())
                .map(|&kind| (kind.name().into(), count(&analysis.events, kind)))
                .collect(),
            longest_gap_s: gaps.map(|event| event.worst).fold(0.0, f64::max),
            lost_ranges: losses.ranges.len() as u64,
            lost_bytes: losses.bytes_lost(),
            missing_messages: losses.missing_messages.values().sum(),
            undecodable_messages: losses.undecodable_messages.values().sum(),
            findings: findings.collect(),
            notes: analysis.notes.clone(),
        }
    }

    /// How many events there are of a kind.
    #[must_use]
    pub fn events_of(&self, kind: EventKind) -> u64 {
        self.event_counts.get(kind.name()).copied().unwrap_or(0)
    }

    /// Whether a person should look at the log: a wheel or an edge has an event, or a load came within
    /// two standard deviations of nothing.
    #[must_use]
    pub fn has_findings(&self) -> bool {
        let mut stability = EventKind::all().iter().filter(|kind| kind.is_stability());
        stability.any(|&kind| self.events_of(kind) > 0)
            || self.largest_utilisation.is_some_and(|u| u >= 1.0)
    }
}

/// The facts of all events of an analysis.
#[must_use]
pub fn event_facts(analysis: &Analysis) -> Vec<EventFacts> {
    let rows = &analysis.rows;
    let last_ns = rows.times_ns[rows.len() - 1];
    let facts = analysis.events.iter().map(|event| {
        let cause = event
            .causes
            .as_ref()
            .and_then(|causes| causes.shares.first());
        EventFacts {
            kind: event.kind.name().into(),
            subject: event.subject.clone(),
            start_ns: event.start_ns,
            end_ns: event.end_ns,
            duration_s: (event.end_ns.unwrap_or(last_ns) - event.start_ns) as f64 * 1e-9,
            worst: known(event.worst),
            unit: event.unit.into(),
            worst_ns: event.worst_ns,
            lead_s: event.lead_s,
            certainty: event.certainty,
            split_dependent: event.split_dependent,
            main_cause: cause.map(|share| share.cause.into()),
            main_cause_percent: cause.and_then(|share| known(share.percent)),
        }
    });
    facts.collect()
}

fn count(events: &[Event], kind: EventKind) -> u64 {
    events.iter().filter(|event| event.kind == kind).count() as u64
}

fn wheel_facts(analysis: &Analysis, wheel: usize) -> WheelFacts {
    let rows = &analysis.rows;
    let valid = |quantity: Quantity| {
        let values = rows.outcomes.column(quantity).iter().enumerate();
        values.filter_map(|(row, &value)| rows.is_valid(row).then_some(value))
    };
    WheelFacts {
        name: analysis.machine.wheels()[wheel].name.to_lowercase(),
        static_load_n: known(analysis.machine.reference().static_load[wheel]),
        least_otf_n: valid(Quantity::Otf(wheel)).reduce(f64::min),
        least_load_n: valid(Quantity::Load(wheel)).reduce(f64::min),
        largest_load_n: valid(Quantity::Load(wheel)).reduce(f64::max),
    }
}

fn known(value: f64) -> Option<f64> {
    Some(value).filter(|v| v.is_finite())
}
