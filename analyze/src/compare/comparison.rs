//! The differences between two results.

use serde::Serialize;
use tipwatch_language::{say, word};

use super::facts::{self, EventPair, FactDifference};
use super::inputs::{self, InputDifference};
use super::series::{self, SeriesComparison};
use super::side::{Side, SideSummary};
use crate::base::table::Table;
use crate::events::{Event, EventKind, Reply};

/// Version of the document.
const SCHEMA: u32 = 2;

/// The differences between A and B.
#[derive(Debug, Serialize)]
pub struct Comparison {
    /// Version of this document's keys.
    pub schema: u32,
    /// Origin of A.
    pub a: SideSummary,
    /// Origin of B.
    pub b: SideSummary,
    /// Whether both sides are results of the same log, by content.
    pub same_log: bool,
    /// The inputs that differ, by key.
    pub inputs: Vec<InputDifference>,
    /// First row of B (s after that of A), where both are of one log or have rows at the same times: then the events of both count
    /// from the first row of A. Null where those of each count from its own.
    pub b_begins_s: Option<f64>,
    /// Events; those on one side only come first. Those of different logs without rows at the same times are on one side each.
    pub events: Vec<EventPair>,
    /// Figures of the whole log, largest difference first within each unit.
    pub facts: Vec<FactDifference>,
    /// Differences row by row; null if the rows have different times.
    pub series: Option<SeriesComparison>,
    /// Reason why there is no comparison row by row.
    pub series_note: Option<String>,
    /// Limits of the comparison.
    pub caveats: Vec<String>,
}

impl Comparison {
    /// States of every event that was asked about whether it would have happened as supposed in B.
    pub fn suppose(&mut self, recorded: &Table, replies: &[(&Event, Reply)]) {
        for (event, reply) in replies {
            let start_s = recorded.seconds_at(event.start_ns);
            let of = (event.kind, event.subject.as_str());
            facts::answer(&mut self.events, of, start_s, reply);
        }
        // the gravest first: a lift is part of a tipping
        let asked = self.events.iter().filter(|pair| pair.supposed.is_some());
        let gravest = asked.min_by_key(|pair| pair.kind == EventKind::WheelLift);
        if let Some((what, answer)) = gravest.and_then(|pair| Some((pair.what(), pair.answer()?))) {
            let finding = &self.b.finding;
            self.b.finding =
                say!("By the rows of the event, {what}: {answer}. By its valid rows: {finding}");
        }
    }
}

/// Compares two sides.
#[must_use]
pub fn compare(a: &Side, b: &Side) -> Comparison {
    let (about_a, mut about_b) = (SideSummary::of(a), SideSummary::of(b));
    let same_log = about_a.is_of_same_log(&about_b);
    let (series, series_note) = match series::compare(a, b) {
        Ok(series) => (Some(series), None),
        Err(note) => (None, Some(note)),
    };
    // copies, clips and recovered logs have other bytes and the same times
    let has_same_times = series.is_some();
    let caveat = word!("The logs differ; rows are compared as they have the same times.");
    let caveats = (!same_log && has_same_times).then(|| caveat.to_owned());
    let events = facts::events(a, b, same_log, has_same_times);
    let b_begins_s = (b.first_ns() - a.first_ns()) as f64 * 1e-9;
    let b_begins_s = (same_log || has_same_times).then_some(b_begins_s);
    if b_begins_s.is_some_and(|begins_s| begins_s != 0.0) {
        let finding = &about_b.finding;
        about_b.finding = say!("{finding} (t from the first row of B)");
    }
    Comparison {
        schema: SCHEMA,
        same_log,
        inputs: inputs::inputs(a, b),
        b_begins_s,
        facts: facts::facts(a, b, &events),
        events,
        series,
        series_note,
        caveats: caveats.into_iter().collect(),
        a: about_a,
        b: about_b,
    }
}
