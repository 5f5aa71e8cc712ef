//! The differences between two results.

use serde::Serialize;

use super::facts::{self, EventPair, FactDifference};
use super::inputs::{self, InputDifference};
use super::series::{self, SeriesComparison};
use super::side::{Side, SideSummary};

/// Version of the document.
const SCHEMA: u32 = 1;

/// The differences between A and B.
#[derive(Debug, Serialize)]
pub struct Comparison {
    /// Version of this document's keys.
    pub schema: u32,
    /// Origin of A.
    pub a: SideSummary,
    /// Origin of B.
    pub b: SideSummary,
    /// Whether both are results of the same log, by content.
    pub same_log: bool,
    /// The inputs that differ, by key.
    pub inputs: Vec<InputDifference>,
    /// Events; those on one side only come first.
    pub events: Vec<EventPair>,
    /// Figures of the whole log, largest difference first within each unit.
    pub facts: Vec<FactDifference>,
    /// Differences row by row; null if the rows have different times.
    pub series: Option<SeriesComparison>,
    /// Why there is no comparison row by row.
    pub series_note: Option<String>,
    /// What the comparison cannot show.
    pub caveats: Vec<String>,
}

/// Compares two sides.
#[must_use]
pub fn compare(a: &Side, b: &Side) -> Comparison {
    let (series, series_note) = match series::compare(a, b) {
        Ok(series) => (Some(series), None),
        Err(note) => (None, Some(note)),
    };
    let (about_a, about_b) = (a.about(), b.about());
    let events = facts::events(a, b);
    Comparison {
        schema: SCHEMA,
        same_log: about_a.log_sha256 == about_b.log_sha256,
        inputs: inputs::inputs(a, b),
        facts: facts::facts(a, b, &events),
        events,
        series,
        series_note,
        caveats: Vec::new(),
        a: about_a,
        b: about_b,
    }
}
