//! Writes the files of an analysis or a replay into an output folder, never beside the log.

pub mod clips;
pub mod custody;
pub mod differences;
mod options;
mod sinks;

use std::path::Path;

use anyhow::Result;

use crate::analysis::Analysis;
use crate::analysis::run::{Prepared, RowSink};
use crate::base::files::{make_folder, write_atomically};
use crate::base::options::Precision;
use crate::events::Event;
use crate::policy::Judgement;
use crate::report;
use crate::report::Sketch;
use crate::suspension::{self, Summary as WhatIfSummary, WhatIf};
use crate::tables::summary::Summary;
use crate::tables::{events, parquet, studies};

pub(crate) use self::clips::CLIPS;
use self::options::REPORT;
pub(crate) use self::options::{DERIVED, EVENTS, SAMPLES};
pub use self::options::{OutputOptions, Outputs, SUMMARY};
use self::sinks::Documents;
pub use self::sinks::Sinks;

/// The report on paper.
pub const PDF: &str = "report.pdf";
/// The judgement of a policy.
pub const JUDGEMENT: &str = "policy.json";

/// Writes the files of an analysis into `folder`, which is created if missing; returns their names.
///
/// # Errors
/// A file cannot be written.
pub fn write(
    analysis: &Analysis,
    folder: &Path,
    options: OutputOptions,
) -> Result<Vec<&'static str>> {
    let of_inputs = analysis.events.iter().filter(|e| !e.kind.is_stability());
    let input_events: Vec<Event> = of_inputs.cloned().collect();
    let prepared = Prepared {
        machine: &analysis.machine,
        table: &analysis.rows,
        options: &analysis.options,
        input_events: &input_events,
        measured_loads: &analysis.measured_loads,
    };
    let mut sinks = Sinks::begin(&prepared, folder, options)?;
    analysis.rows.feed(&mut |rows| sinks.take(rows))?;
    sinks.settle(analysis.rows.len(), None, &analysis.events)?;
    finish(analysis, sinks, folder).map(|written| written.files)
}

/// Finishes the files of an analysis whose rows the sinks have taken.
///
/// # Errors
/// A file cannot be written.
pub fn finish(analysis: &Analysis, sinks: Sinks, folder: &Path) -> Result<Written> {
    // the main pass is over; a report and a log need memory of other sizes
    tipwatch_allocator::give_back();
    let precision = sinks.options.precision;
    let samples = sinks.samples;
    let finish_samples = || samples.finish(&analysis.provenance, &folder.join(SAMPLES));
    let Some(documents) = sinks.documents else {
        finish_samples()?;
        return Ok(Written {
            files: vec![SAMPLES],
            sketch: None,
        });
    };
    let Documents {
        sketch,
        mut derived,
    } = documents;
    let (tables, sketch) = rayon::join(
        || {
            finish_samples()?;
            write_events(analysis, folder)?;
            write_further_tables(analysis, folder, precision)
        },
        || {
            let (report, rows) = rayon::join(
                || {
                    let sketch = sketch.finish();
                    write_report(analysis, &sketch, folder).map(|page| (sketch, page))
                },
                || derived.write_rest(analysis),
            );
            rows?;
            let (sketch, page) = report?;
            derived.finish(analysis, &page, &folder.join(DERIVED))?;
            Ok::<_, anyhow::Error>(sketch)
        },
    );
    let (further, sketch) = (tables?, sketch?);
    let always = [SAMPLES, EVENTS, SUMMARY, REPORT, DERIVED];
    Ok(Written {
        files: always.into_iter().chain(further).collect(),
        sketch: Some(sketch),
    })
}

/// The files of an analysis.
#[derive(Debug)]
pub struct Written {
    /// Names of the files.
    pub files: Vec<&'static str>,
    /// Sketch of the report.
    pub sketch: Option<Sketch>,
}

fn write_events(analysis: &Analysis, folder: &Path) -> Result<()> {
    let path = folder.join(EVENTS);
    let table = events::events(&analysis.events);
    parquet::write(&table, &analysis.provenance, &path)
}

/// Writes the tables that not every analysis has; returns their names.
fn write_further_tables(
    analysis: &Analysis,
    folder: &Path,
    precision: Precision,
) -> Result<Vec<&'static str>> {
    let mut written = Vec::new();
    for (name, table) in [
        ("sensitivity.parquet", studies::sensitivity(analysis)),
        (
            "monte_carlo.parquet",
            studies::monte_carlo(analysis, precision),
        ),
    ] {
        if let Some(table) = table {
            parquet::write(&table, &analysis.provenance, &folder.join(name))?;
            written.push(name);
        }
    }
    Ok(written)
}

/// Writes the summary and the report; returns the text of the report.
fn write_report(analysis: &Analysis, sketch: &Sketch, folder: &Path) -> Result<String> {
    let summary = Summary::of(analysis, report::main_findings(analysis));
    let text = serde_json::to_string_pretty(&summary)?;
    write_text(&folder.join(SUMMARY), &text)?;
    let page = report::render_sketch(analysis, sketch);
    write_text(&folder.join(REPORT), &page)?;
    Ok(page)
}

/// Writes the report as PDF/A-2b: `report.pdf`.
///
/// # Errors
/// The report cannot be written as PDF/A, or the file cannot be written.
pub fn write_pdf(analysis: &Analysis, sketch: Option<&Sketch>, folder: &Path) -> Result<()> {
    let path = folder.join(PDF);
    let bytes = match sketch {
        Some(sketch) => report::render_sketch_as_pdf(analysis, sketch)?,
        None => report::render_pdf(analysis)?,
    };
    write_atomically(&path, &bytes)
}

/// Writes the judgement of a policy: `policy.json`. A log that could not be analysed has nothing else.
///
/// # Errors
/// The file cannot be written.
pub fn write_judgement(judgement: &Judgement, folder: &Path) -> Result<()> {
    let text = serde_json::to_string_pretty(judgement)?;
    write_text(&folder.join(JUDGEMENT), &text)
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    write_atomically(path, text.as_bytes())
}

impl WhatIf {
    /// Writes `whatif.parquet`, `summary.json` and `report.html` into a folder, which is created if missing.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        make_folder(folder)?;
        let table = suspension::table::table(self);
        let path = folder.join("whatif.parquet");
        parquet::write(&table, &self.analysis.provenance, &path)?;
        let summary = serde_json::to_string_pretty(&WhatIfSummary::of(self))?;
        for (name, text) in [
            ("summary.json", summary),
            ("report.html", report::render_what_if(self)),
        ] {
            write_text(&folder.join(name), &text)?;
        }
        Ok(())
    }
}
