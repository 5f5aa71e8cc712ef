//! Assembles the report on a log from its sections.

use anyhow::Result;
use maud::{Markup, html};
use tipwatch_binding::sha256;
use tipwatch_language::{say, word};

use super::findings::{finding_list, findings};
use super::moment::Moments;
use super::plots::{self, MOST_EVENTS, Part};
use super::sketch::{Detail, Sketch};
use super::{
    basis, charts, clocks, explanations, health, machine_view, measured_loads, moment, path, pdf,
    prevention, sheet, sliders, tables, unstated_load,
};
use crate::analysis::Analysis;
use crate::analysis::calendar::Calendar;
use crate::events::support_words::SupportWord;
use crate::page::svg::CHART_STYLE;
use crate::page::{self, Columns, Document, Plots, Scripts, packed_script, part};

const SCRIPT: &str = concat!(include_str!("moment.js"), "\n", include_str!("sliders.js"));

/// Renders the report on a log, as an HTML page with everything it needs inside.
///
/// The same analysis gives the same bytes.
#[must_use]
pub fn render(analysis: &Analysis) -> String {
    render_sketch(analysis, &Sketch::of(analysis))
}

/// Renders the report with a sketch that was made while the rows were computed.
#[must_use]
pub fn render_sketch(analysis: &Analysis, sketch: &Sketch) -> String {
    render_with(analysis, sketch, Scripts::Within(SCRIPT))
}

/// Renders one of many reports, whose scripts are in the file of this name in the folder above its own.
pub(crate) fn render_beside(analysis: &Analysis, sketch: &Sketch, library: &str) -> String {
    render_with(analysis, sketch, Scripts::Beside(&format!("../{library}")))
}

/// The scripts that many reports share, and the name of their file: that of another version is another one.
pub(crate) fn shared_library() -> (String, String) {
    let script = page::library(SCRIPT);
    let hash = sha256(script.as_bytes());
    let name = format!("report-{}.js", hash.get(..12).unwrap_or(&hash));
    (name, script)
}

fn render_with(analysis: &Analysis, sketch: &Sketch, scripts: Scripts<'_>) -> String {
    let columns = Columns::with_room(sketch.points_drawn());
    let rows = &analysis.rows;
    let last_s = rows
        .len()
        .checked_sub(1)
        .map_or(0.0, |last| rows.seconds(last));
    let columns = match scripts {
        Scripts::Within(_) => columns,
        Scripts::Beside(_) => columns.pictured(last_s),
    };
    let moments = || {
        let moments = Moments::of(analysis, &sketch.instants);
        (packed_script("moments", &moments), moments)
    };
    let mut meanwhile = None;
    let figures = rayon::in_place_scope(|scope| {
        scope.spawn(|_| meanwhile = Some(moments()));
        plots::figures(analysis, sketch, &columns)
    });
    let (moments_data, moments) = meanwhile.unwrap_or_else(moments);
    let drawn = Drawn {
        detail: sketch.detail,
        of: &|part| page::figures(&figures, part.name()),
        loads: html! { (how_to_read(analysis, sketch.detail.points)) (page::figures(&figures, Part::Loads.name())) },
        posture: moment::section(&moments),
        sliders: sliders::section(analysis),
        path: path::section(analysis, sketch.path.as_ref()),
        has_study: figures
            .iter()
            .any(|figure| figure.part == Part::Study.name()),
    };
    let parts = parts(analysis, &drawn);
    let content = html! {
        (sheet::section(analysis))
        nav.contents aria-label=(word!("Contents")) {
            h2 { (word!("For experts")) }
            ol { @for (id, title, _) in &parts { li { a href=(format_args!("#{id}")) { (title) } } } }
            button.screen type="button" id="open-all" data-fold=(word!("Fold all parts")) hidden { (word!("Open all parts")) }
        }
        @for (place, (id, title, content)) in parts.iter().enumerate() { (part(id, title, place == 0, content)) }
    };
    Document {
        title: &title(analysis),
        subtitle: &subtitle(analysis),
        styles: &[CHART_STYLE],
        plots: Some(Plots {
            figures: &figures,
            columns: &columns,
            scripts,
            data: &moments_data,
        }),
    }
    .render(&content)
}

/// Renders the report as PDF/A-2b, with charts instead of moving parts.
///
/// # Errors
/// The report cannot be written as PDF/A.
pub fn render_pdf(analysis: &Analysis) -> Result<Vec<u8>> {
    render_sketch_as_pdf(analysis, &Sketch::of(analysis))
}

/// Renders the report as PDF/A-2b with a sketch that was made while the rows were computed.
///
/// # Errors
/// The report cannot be written as PDF/A.
pub fn render_sketch_as_pdf(analysis: &Analysis, sketch: &Sketch) -> Result<Vec<u8>> {
    let drawn = Drawn {
        detail: sketch.detail,
        of: &|_| html! {},
        loads: charts::section(analysis, sketch),
        posture: html! {},
        sliders: html! {},
        path: path::section(analysis, sketch.path.as_ref()),
        has_study: false,
    };
    let content = html! {
        (sheet::section(analysis))
        @for (_, title, content) in parts(analysis, &drawn) { section { h2 { (title) } (content) } }
    };
    let content = html! { (content) (page::glossary(&content)) };
    let last_ns = analysis.rows.times_ns.last().copied().unwrap_or(0);
    let date = Calendar::of(analysis).instant(last_ns).unwrap_or_default();
    pdf::render(&title(analysis), &subtitle(analysis), date, &content)
}

/// Parts that differ between a screen and paper.
struct Drawn<'a> {
    detail: Detail,
    /// The figures of a part.
    of: &'a dyn Fn(Part) -> Markup,
    loads: Markup,
    posture: Markup,
    sliders: Markup,
    path: Option<Markup>,
    has_study: bool,
}

/// A part for experts: its name for links, title and content.
type ExpertPart = (&'static str, &'static str, Markup);

fn parts(analysis: &Analysis, drawn: &Drawn<'_>) -> Vec<ExpertPart> {
    let figures = |part| (drawn.of)(part);
    let detail = drawn.detail;
    let events = html! {
        (top_findings(analysis, detail.findings)) (figures(Part::Events)) (tables::events(analysis, detail.events))
    };
    let loads_at_onset = sheet::row(analysis).map(|row| {
        html! {
            h3 { (say!("At t = {:.2} s", analysis.rows.seconds(row))) }
            (machine_view::loads(analysis, row))
        }
    });
    let loads = html! {
        @if let Some(warning) = unstated_load::warning(analysis) { (warning) }
        @if let Some(loads) = loads_at_onset { (loads) }
        (drawn.loads)
        @if let Some(measured) = measured_loads::section(analysis) { h3 { (word!("Measured loads")) } (measured) }
    };
    let causes = html! {
        (explanations::causes(analysis, detail.causes_of_kind)) (figures(Part::Causes))
        @if let Some(explained) = unstated_load::section(analysis) {
            h3 { (word!("What explains the rotation about an edge")) } (explained)
        }
    };
    let prevention = html! { (prevention::section(analysis)) (drawn.sliders) };
    let indicators = html! {
        @if let Some(hint) = basis::about_pivot(&analysis.machine) { p.hint { (hint) } }
        (figures(Part::Indicators))
    };
    let posture = html! {
        @if let Some(warning) = unstated_load::warning(analysis) { (warning) }
        (drawn.posture)
        @if let Some(path) = &drawn.path { h3 { (word!("Path on the ground")) } (path) }
    };
    let inputs = html! {
        (tables::inputs(analysis)) (figures(Part::Inputs))
        h3 { (word!("Health of the sensors")) } (health::section(analysis))
        h3 { (word!("Clocks")) } (clocks::clocks(analysis))
    };
    let model = html! {
        (explanations::sensitivity(analysis))
        (explanations::models(analysis))
        @if drawn.has_study { h3 { (word!("Random machines")) } (figures(Part::Study)) }
    };
    let mut all = vec![
        ("events", word!("Events"), events),
        ("loads", loads_of(analysis), loads),
        ("causes", word!("What caused the unloading"), causes),
        (
            "prevention",
            word!("What would have prevented it"),
            prevention,
        ),
        ("indicators", word!("Stability indicators"), indicators),
        ("posture", word!("Posture and path"), posture),
        ("inputs", word!("Inputs and clocks"), inputs),
        ("model", word!("Sensitivity, models and uncertainty"), model),
        (
            "methods",
            word!("Methods and assumptions"),
            basis::methods(analysis),
        ),
        (
            "validation",
            word!("Validation"),
            basis::validation(&analysis.machine),
        ),
        (
            "limitations",
            word!("Limitations"),
            basis::limitations(analysis),
        ),
        (
            "custody",
            word!("Custody and provenance"),
            tables::provenance(analysis),
        ),
    ];
    // on paper some parts have nothing
    all.retain(|(.., content)| !content.0.is_empty());
    all
}

fn title(analysis: &Analysis) -> String {
    let name = analysis.provenance.log_name();
    say!("{} and stability: {name}", loads_of(analysis))
}

/// The title of what the program computes.
fn loads_of(analysis: &Analysis) -> &'static str {
    match SupportWord::of(&analysis.machine).is_wheel() {
        true => word!("Wheel loads"),
        false => word!("Support loads"),
    }
}

fn subtitle(analysis: &Analysis) -> String {
    let rows = &analysis.rows;
    let duration = rows
        .len()
        .checked_sub(1)
        .map_or(0.0, |last| rows.seconds(last));
    let (machine, count) = (analysis.machine.name(), rows.len());
    let from = &analysis.provenance;
    // "E. X." ends with a stop of its own
    let [case, examiner] = [&from.case, &from.examiner].map(|it| it.as_deref());
    let case = case.map(|case| say!("Case {}. ", case.trim_end_matches('.')));
    let examiner = examiner.map(|it| say!("Examiner {}. ", it.trim_end_matches('.')));
    say!(
        "{}{}Machine {machine}; {count} rows over {duration:.2} s.",
        case.unwrap_or_default(),
        examiner.unwrap_or_default()
    )
}

/// Renders the main findings about the machine; faults and gaps of inputs are grouped in the table of events.
fn top_findings(analysis: &Analysis, most: usize) -> Markup {
    let findings = findings(analysis);
    let events = analysis.events.iter();
    let of_inputs = events.filter(|event| !event.kind.is_stability()).count();
    let count = findings.len().saturating_sub(of_inputs);
    html! {
        (finding_list(&findings[..count.min(most)]))
        @if count > most {
            p { (say!("{} more are in events.parquet.", count - most)) }
        }
        @if of_inputs > 0 {
            p {
                @match of_inputs {
                    1 => { (word!("One fault or gap of an input is in the table of input faults below the events.")) }
                    count => { (say!("{count} faults and gaps of inputs are grouped in the table of input faults below the events.")) }
                }
            }
        }
    }
}

/// Renders the instructions for reading the figures.
fn how_to_read(analysis: &Analysis, most_points: usize) -> Markup {
    let SupportWord { one, many, .. } = SupportWord::of(&analysis.machine);
    html! {
        (page::figures_help())
        p.hint {
            (say!("Curves break where loads cannot be computed. They continue while the machine tips over, but are not accurate there. Events \
             are shaded. OTF (overturning force) is the load a {one} would carry if every {one} were held to the ground; it is negative \
             where the {one} would have to be pulled down. Pale areas are envelopes: the range of loads that equilibrium allows, for any \
             split of the load between the {many}. Darker ones are bands of two standard deviations under the stated split."))
        }
        @if analysis.rows.len() > most_points {
            p.hint {
                (say!("Curves are decimated for drawing: each shows at most {most_points} of {} rows and always keeps the minimum and \
                the maximum of every interval.", analysis.rows.len()))
            }
        }
        @if analysis.events.len() > MOST_EVENTS {
            p.hint { (say!("Only the {MOST_EVENTS} most important events are shaded.")) }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use std::path::Path;
    use std::process::Command;

    use tipwatch_binding::MachineFile;
    use tipwatch_language::{Language, choose};

    use super::*;
    use crate::analysis::run::analyse;
    use crate::base::options::Options;

    /// Least size of letters that can be read on paper (points).
    const LEAST_LETTERS: f32 = 5.0;
    /// Tells the test that it is the one in German: a process speaks one language.
    const IN_GERMAN: &str = "TIPWATCH_TEST_IN_GERMAN";

    #[test]
    fn the_first_page_on_paper_can_be_read() {
        if std::env::var_os(IN_GERMAN).is_some() {
            choose(Language::German);
        } else {
            let mut german = Command::new(std::env::current_exe().unwrap());
            let name = "report::log_report::tests::the_first_page_on_paper_can_be_read";
            german.args(["--exact", name]).env(IN_GERMAN, "");
            let found = String::from_utf8(german.output().unwrap().stdout).unwrap();
            assert!(found.contains("1 passed"), "{found}");
        }
        // the last one has no event
        for name in ["tip_over", "crane", "lift", "tiny"] {
            let log = format!("../tests/data/{name}.mcap");
            let log = Path::new(env!("CARGO_MANIFEST_DIR")).join(log);
            let file = MachineFile::read(&log.with_extension("toml")).unwrap();
            let analysis = analyse(&log, &file, Options::default(), &mut |_| {}).unwrap();
            let content = sheet::section(&analysis);
            let pages = pdf::layout::texts(&title(&analysis), &subtitle(&analysis), &content);
            // what follows begins a page of its own
            let [page, next] = &pages[..] else {
                panic!("{name}: {} pages", pages.len());
            };
            assert!(page.len() > 50 && next.is_empty(), "{name}");
            for (place, text) in page.iter().enumerate() {
                let told = &text.text;
                assert!(text.is_on_the_page(), "{name}: {told}: {text:?}");
                assert!(text.size >= LEAST_LETTERS, "{name}: {told}: {text:?}");
                for other in &page[place + 1..] {
                    assert!(!text.is_over(other), "{name}: {told} and {}", other.text);
                }
            }
        }
    }
}
