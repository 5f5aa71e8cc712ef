//! The report: one page for people, complete in itself, that opens without a network.

mod clocks;
mod explanations;
mod faults;
mod findings;
mod moment;
mod plots;
mod prevention;
mod tables;
mod whatif;

use std::path::Path;

use maud::{Markup, html};

pub use findings::findings;
pub(crate) use whatif::render_what_if;

use self::plots::MOST_EVENTS;
use crate::analysis::Analysis;
use crate::events::Finding;
use crate::page::{self, Document, Figure, MOST_POINTS, Plots, list, section};
pub use crate::page::{PlotLibrary, plot_library_script};

const MOMENT_SCRIPT: &str = include_str!("moment.js");
/// Findings at the top of the page; the table of events has all.
const MOST_FINDINGS: usize = 12;
/// The report on a log, as an HTML page with everything it needs inside, or the plot library beside it.
///
/// The same analysis gives the same bytes.
#[must_use]
pub fn render(analysis: &Analysis, library: PlotLibrary<'_>) -> String {
    let figures = plots::figures(analysis);
    let content = html! {
        (section("Findings", top_findings(analysis)))
        (section("Events", tables::events(analysis)))
        (section("View from above", moment::section(analysis)))
        (section("What caused the unloading", explanations::causes(analysis)))
        (section("Time histories", time_histories(analysis, &figures)))
        (section("What would have prevented it", explanations::prevention(analysis)))
        (section("Sensitivity", explanations::sensitivity(analysis)))
        (section("Models and uncertainty", explanations::models(analysis)))
        (section("Inputs", tables::inputs(analysis)))
        (section("Clocks", clocks::clocks(analysis)))
        (section("Data limitations", tables::limitations(analysis)))
        (section("Provenance", tables::provenance(analysis)))
    };
    let rows = &analysis.rows;
    let duration = rows
        .len()
        .checked_sub(1)
        .map_or(0.0, |last| rows.seconds(last));
    let (machine, count) = (analysis.machine.name(), rows.len());
    Document {
        title: &format!("Wheel loads and stability: {}", log_name(analysis)),
        subtitle: &format!("Machine {machine}; {count} rows over {duration:.2} s."),
        styles: &[],
        plots: Some(Plots {
            library,
            figures: &figures,
            script: MOMENT_SCRIPT,
        }),
    }
    .render(&content)
}

/// Names of the log's files without their folders.
fn log_name(analysis: &Analysis) -> String {
    let name = |path: &str| {
        Path::new(path)
            .file_name()
            .map_or(path.to_string(), |name| name.to_string_lossy().into())
    };
    match analysis.provenance.log.as_slice() {
        [] => "log".to_string(),
        [file] => name(&file.path),
        [first, rest @ ..] => format!("{} and {} more files", name(&first.path), rest.len()),
    }
}

fn top_findings(analysis: &Analysis) -> Markup {
    let findings = findings(analysis);
    html! {
        (finding_list(&findings[..findings.len().min(MOST_FINDINGS)]))
        @if findings.len() > MOST_FINDINGS {
            p { (findings.len() - MOST_FINDINGS) " more are in the table of events." }
        }
    }
}

fn finding_list(findings: &[Finding]) -> Markup {
    html! {
        ul.findings {
            @for finding in findings {
                li { strong { (finding.headline) } (list(&finding.evidence)) }
            }
        }
    }
}

fn time_histories(analysis: &Analysis, figures: &[Figure]) -> Markup {
    html! {
        p.hint {
            "Time is in seconds from the first row. Curves break where loads cannot be computed. "
            "They continue while the machine tips over, but are not accurate there. Events are shaded. "
            "OTF (overturning force) is the load a wheel would carry if every wheel were held to the ground; "
            "it is negative where the wheel would have to be pulled down. "
            "The envelope is the range of loads that equilibrium allows, for any split of the load between the wheels."
        }
        @if analysis.rows.len() > MOST_POINTS {
            p.hint {
                "Curves are decimated for drawing: each shows at most " (MOST_POINTS) " of " (analysis.rows.len())
                " rows and always keeps the minimum and the maximum of every interval."
            }
        }
        @if analysis.events.len() > MOST_EVENTS {
            p.hint { "Only the " (MOST_EVENTS) " most important events are shaded." }
        }
        (page::figures(figures))
    }
}
