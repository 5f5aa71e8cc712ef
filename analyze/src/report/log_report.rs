//! Assembles the report on a log from its sections.

use maud::{Markup, html};

use super::findings::{finding_list, findings};
use super::plots::{self, MOST_EVENTS};
use super::{clocks, explanations, moment, prevention, tables};
use crate::analysis::Analysis;
use crate::page::{self, Document, Figure, MOST_POINTS, PlotLibrary, Plots, section};

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
        (section("What would have prevented it", prevention::section(analysis)))
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
        title: &format!(
            "Wheel loads and stability: {}",
            analysis.provenance.log_name()
        ),
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

fn top_findings(analysis: &Analysis) -> Markup {
    let findings = findings(analysis);
    html! {
        (finding_list(&findings[..findings.len().min(MOST_FINDINGS)]))
        @if findings.len() > MOST_FINDINGS {
            p { (findings.len() - MOST_FINDINGS) " more are in the table of events." }
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
