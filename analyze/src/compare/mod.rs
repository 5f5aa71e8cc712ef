//! Two analyses side by side, their differences ranked: two logs, or one log under two machine files or
//! models, or two folders of results.
//!
//! Everything is taken from the files of a result, `summary.json` and `samples.parquet`; an analysis that
//! was just made is seen through the same documents.

mod facts;
mod page;
mod series;
mod side;
mod text;

use serde::Serialize;

pub use facts::{EventPair, FactDifference};
pub use page::render;
pub use series::{SeriesComparison, SeriesDifference};
pub use side::Side;
pub use text::told;

/// Version of the document.
pub const SCHEMA: u32 = 1;

/// What differs between A and B.
#[derive(Debug, Serialize)]
pub struct Comparison {
    /// Version of this document's keys.
    pub schema: u32,
    /// What A is.
    pub a: SideSummary,
    /// What B is.
    pub b: SideSummary,
    /// Whether both are of the same log, by content.
    pub same_log: bool,
    /// Events, those that only one side has first.
    pub events: Vec<EventPair>,
    /// Numbers of the whole log, largest difference first within each unit.
    pub facts: Vec<FactDifference>,
    /// Row by row, where both have rows at the same times; else null.
    pub series: Option<SeriesComparison>,
    /// Why there is no comparison row by row.
    pub series_note: Option<String>,
}

/// Where a side comes from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SideSummary {
    /// As given on the command line.
    pub name: String,
    /// The log's files.
    pub log: Vec<String>,
    /// SHA-256 of the log's files.
    pub log_sha256: Vec<String>,
    /// The machine's name.
    pub machine: String,
    /// SHA-256 of the machine file.
    pub machine_file_sha256: String,
    /// SHA-256 of the URDF.
    pub urdf_sha256: String,
    /// The model.
    pub model: String,
    /// The estimator.
    pub estimator: String,
    /// The first finding.
    pub finding: String,
}

/// Compares two sides.
#[must_use]
pub fn compare(a: &Side, b: &Side) -> Comparison {
    let (series, series_note) = match series::compare(a, b) {
        Ok(series) => (Some(series), None),
        Err(note) => (None, Some(note)),
    };
    let (about_a, about_b) = (a.about(), b.about());
    Comparison {
        schema: SCHEMA,
        same_log: about_a.log_sha256 == about_b.log_sha256,
        events: facts::events(a, b),
        facts: facts::facts(a, b),
        series,
        series_note,
        a: about_a,
        b: about_b,
    }
}
