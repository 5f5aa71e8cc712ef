//! Assembles the report on a log from its sections.

use anyhow::Result;
use maud::{Markup, html};

use super::findings::{finding_list, findings};
use super::moment::Moments;
use super::plots::{self, MOST_EVENTS};
use super::sketch::Sketch;
use super::when::Calendar;
use super::{
    basis, charts, clocks, conclusion, explanations, health, measured_loads, moment, path, pdf,
    prevention, tables, unstated_load, worst,
};
use crate::analysis::Analysis;
use crate::page::{
    self, Columns, Document, Figure, MOST_POINTS, PlotLibrary, Plots, json_script, section,
};

const MOMENT_SCRIPT: &str = include_str!("moment.js");
/// Findings at the top of the page; the table of events has all.
const MOST_FINDINGS: usize = 12;

/// The report on a log, as an HTML page with everything it needs inside, or the plot library beside it.
///
/// The same analysis gives the same bytes.
#[must_use]
pub fn render(analysis: &Analysis, library: PlotLibrary<'_>) -> String {
    render_sketch(analysis, &Sketch::of(analysis), library)
}

/// The same, with a sketch that was made while the rows were computed.
#[must_use]
pub fn render_sketch(analysis: &Analysis, sketch: &Sketch, library: PlotLibrary<'_>) -> String {
    let columns = Columns::with_room(sketch.points_drawn());
    let moments = || {
        let moments = Moments::of(analysis, &sketch.instants);
        (json_script("moments", &moments), moments)
    };
    let mut meanwhile = None;
    let figures = rayon::in_place_scope(|scope| {
        scope.spawn(|_| meanwhile = Some(moments()));
        plots::figures(analysis, sketch, &columns)
    });
    let (moments_data, moments) = meanwhile.unwrap_or_else(moments);
    let path = path::section(analysis, sketch.path.as_ref());
    let content = html! {
        (opening(analysis))
        (section("The machine over time", moment::section(&moments)))
        @if let Some(path) = &path { (section("Path on the ground", path)) }
        (section("Time histories", time_histories(analysis, &figures)))
        (closing(analysis))
    };
    Document {
        title: &title(analysis),
        subtitle: &subtitle(analysis),
        styles: &[],
        plots: Some(Plots {
            library,
            figures: &figures,
            columns: &columns,
            script: MOMENT_SCRIPT,
            data: &moments_data,
        }),
    }
    .render(&content)
}

/// The same report as PDF/A-2b, with charts instead of what moves on a screen.
///
/// # Errors
/// It cannot be written as PDF/A.
pub fn render_pdf(analysis: &Analysis) -> Result<Vec<u8>> {
    render_sketch_as_pdf(analysis, &Sketch::of(analysis))
}

/// The same, with a sketch that was made while the rows were computed.
///
/// # Errors
/// It cannot be written as PDF/A.
pub fn render_sketch_as_pdf(analysis: &Analysis, sketch: &Sketch) -> Result<Vec<u8>> {
    let path = path::section(analysis, sketch.path.as_ref());
    let content = html! {
        (opening(analysis))
        @if let Some(path) = &path { (section("Path on the ground", path)) }
        (section("Time histories", charts::section(analysis, sketch)))
        (closing(analysis))
    };
    let content = html! { (content) (page::glossary(&content)) };
    let last_ns = analysis.rows.times_ns.last().copied().unwrap_or(0);
    let date = Calendar::of(analysis).instant(last_ns).unwrap_or_default();
    pdf::render(&title(analysis), &subtitle(analysis), date, &content)
}

fn title(analysis: &Analysis) -> String {
    let name = analysis.provenance.log_name();
    format!("Wheel loads and stability: {name}")
}

fn subtitle(analysis: &Analysis) -> String {
    let rows = &analysis.rows;
    let duration = rows
        .len()
        .checked_sub(1)
        .map_or(0.0, |last| rows.seconds(last));
    let (machine, count) = (analysis.machine.name(), rows.len());
    let from = &analysis.provenance;
    let case = from.case.as_ref().map(|case| format!("Case {case}. "));
    let examiner = from.examiner.as_ref();
    let examiner = examiner.map(|examiner| format!("Examiner {examiner}. "));
    format!(
        "{}{}Machine {machine}; {count} rows over {duration:.2} s.",
        case.unwrap_or_default(),
        examiner.unwrap_or_default()
    )
}

/// What happened.
fn opening(analysis: &Analysis) -> Markup {
    html! {
        (section("Conclusion", conclusion::section(analysis)))
        (section("Findings", top_findings(analysis)))
        (section("Worst moment", worst::section(analysis)))
        (section("Events", tables::events(analysis)))
        (section("What caused the unloading", explanations::causes(analysis)))
    }
}

/// What it rests on.
fn closing(analysis: &Analysis) -> Markup {
    html! {
        @if let Some(explained) = unstated_load::section(analysis) {
            (section("What explains the rotation about an edge", explained))
        }
        (section("What would have prevented it", prevention::section(analysis)))
        (section("Sensitivity", explanations::sensitivity(analysis)))
        @if let Some(measured) = measured_loads::section(analysis) {
            (section("Measured loads", measured))
        }
        (section("Models and uncertainty", explanations::models(analysis)))
        (section("Inputs", tables::inputs(analysis)))
        (section("Health of the sensors", health::section(analysis)))
        (section("Clocks", clocks::clocks(analysis)))
        (section("Methods and assumptions", basis::methods(analysis)))
        (section("Validation", basis::validation()))
        (section("Limitations", basis::limitations(analysis)))
        (section("Custody and provenance", tables::provenance(analysis)))
    }
}

/// What happened to the machine; faults and gaps of inputs are grouped in the table of events.
fn top_findings(analysis: &Analysis) -> Markup {
    let findings = findings(analysis);
    let events = analysis.events.iter();
    let of_inputs = events.filter(|event| !event.kind.is_stability()).count();
    let count = findings.len().saturating_sub(of_inputs);
    html! {
        (finding_list(&findings[..count.min(MOST_FINDINGS)]))
        @if count > MOST_FINDINGS {
            p { (count - MOST_FINDINGS) " more are in the table of events." }
        }
        @if of_inputs > 0 {
            p { (of_inputs) " faults and gaps of inputs are grouped in the table of input faults below the events." }
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
            "The wide, pale areas are envelopes: the range of loads that equilibrium allows, for any split of the load between the wheels. "
            "The narrow ones are bands of two standard deviations under the stated split."
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
