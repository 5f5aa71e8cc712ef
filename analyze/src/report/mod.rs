//! The report: one page for people, complete in itself, that opens without a network.

mod clocks;
mod decimate;
mod explanations;
mod faults;
mod findings;
mod moment;
mod plots;
mod prevention;
mod tables;
mod whatif;

use std::path::Path;

use plotly::Plot;

pub use findings::findings;
pub(crate) use whatif::render_what_if;

use self::plots::{Figure, MOST_EVENTS, MOST_POINTS};
use crate::analysis::Analysis;
use crate::page::html;

pub(crate) const STYLE: &str = include_str!("style.css");
const SCRIPTS: [&str; 2] = [include_str!("moment.js"), include_str!("page.js")];
/// Findings in words at the top of the page; the table of events has all.
const MOST_FINDINGS: usize = 12;

/// Where the plots' library is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlotLibrary<'a> {
    /// In the page itself.
    Inside,
    /// In a file at this relative address, which several pages share: [`plot_library_script`].
    Beside(&'a str),
}

impl PlotLibrary<'_> {
    /// What the page may load: nothing from anywhere else, whatever a name in the log says.
    fn policy(self) -> String {
        let scripts = match self {
            Self::Inside => "'unsafe-inline'",
            // opened as a file, a page has no 'self'
            Self::Beside(_) => "'unsafe-inline' 'self' file:",
        };
        format!(
            "default-src 'none'; script-src {scripts}; style-src 'unsafe-inline'; img-src data: blob:"
        )
    }

    fn element(self) -> String {
        match self {
            Self::Inside => plot_library(),
            Self::Beside(address) => {
                format!("<script src=\"{}\"></script>\n", html::escape(address))
            }
        }
    }
}

/// The report on a log, as an HTML page with everything it needs inside, or the plot library beside it.
///
/// The same analysis gives the same bytes.
#[must_use]
pub fn render(analysis: &Analysis, library: PlotLibrary<'_>) -> String {
    let figures = plots::figures(analysis);
    let mut page = String::with_capacity(1 << 20);
    page.push_str(&section("Findings", &top_findings(analysis)));
    page.push_str(&section("Events", &tables::events(analysis)));
    page.push_str(&section("The moment itself", &moment::section(analysis)));
    page.push_str(&section("Causes", &explanations::causes(analysis)));
    page.push_str(&section("Curves", &curves(analysis, &figures)));
    page.push_str(&section(
        "What would have prevented it",
        &explanations::prevention(analysis),
    ));
    page.push_str(&section(
        "Sensitivity",
        &explanations::sensitivity(analysis),
    ));
    page.push_str(&section(
        "Model and uncertainty",
        &explanations::models(analysis),
    ));
    page.push_str(&section("Inputs", &tables::inputs(analysis)));
    page.push_str(&section("Clocks", &clocks::clocks(analysis)));
    page.push_str(&section("Data limitations", &tables::limitations(analysis)));
    page.push_str(&section("Provenance", &tables::provenance(analysis)));
    page_of(&head(analysis, library), &page, &figures, library)
}

/// A page from its head, its sections and the figures in them.
fn page_of(head: &str, content: &str, figures: &[Figure], library: PlotLibrary<'_>) -> String {
    [
        head,
        content,
        &library.element(),
        &scripts(figures),
        "</body>\n</html>\n",
    ]
    .concat()
}

fn head(analysis: &Analysis, library: PlotLibrary<'_>) -> String {
    let (log, machine) = (log_name(analysis), analysis.machine.name());
    let rows = analysis.rows.len();
    let duration = if rows == 0 {
        0.0
    } else {
        analysis.rows.seconds(rows - 1)
    };
    head_of(
        &format!("Wheel loads and stability: {log}"),
        &format!("Machine {machine}; {rows} rows over {duration:.2} s."),
        library,
    )
}

/// The head of a page, up to its title and what stands below that; both plain text.
fn head_of(title: &str, subtitle: &str, library: PlotLibrary<'_>) -> String {
    let (title, subtitle) = (html::escape(title), html::escape(subtitle));
    let policy = library.policy();
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         <h1>{title}</h1>\n\
         <p class=\"subtitle\">{subtitle}</p>\n"
    )
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

pub(crate) fn section(title: &str, content: &str) -> String {
    format!(
        "<section>\n<h2>{}</h2>\n{content}</section>\n",
        html::escape(title)
    )
}

fn top_findings(analysis: &Analysis) -> String {
    let mut sentences = findings(analysis);
    if let Some(more) = sentences
        .len()
        .checked_sub(MOST_FINDINGS)
        .filter(|&more| more > 0)
    {
        sentences.truncate(MOST_FINDINGS);
        sentences.push(format!("{more} more are in the table of events."));
    }
    html::list("findings", &sentences)
}

fn curves(analysis: &Analysis, figures: &[Figure]) -> String {
    let mut content = String::from(
        "<p class=\"hint\">Time is in seconds from the first row. Lines break where loads cannot be computed; while the machine tips they go on, without claim of accuracy. Shaded: events. \
         Envelope: what equilibrium allows, however the loads split between the wheels. \
         OTF: load with all wheels held to the ground, negative where a wheel would have to pull.</p>\n\
         <p class=\"hint screen\">Drag to zoom, double-click to see everything; all plots share the time axis. \
         Click a name below a plot to show or hide its curve.</p>\n",
    );
    if analysis.rows.len() > MOST_POINTS {
        content.push_str(&format!(
            "<p class=\"hint\">Curves are decimated for drawing: of {} rows at most {MOST_POINTS} points a curve are \
             drawn, always with the smallest and the largest value of every stretch.</p>\n",
            analysis.rows.len()
        ));
    }
    if analysis.events.len() > MOST_EVENTS {
        content.push_str(&format!(
            "<p class=\"hint\">Only the {MOST_EVENTS} most important events are shaded.</p>\n"
        ));
    }
    for (index, figure) in figures.iter().enumerate() {
        content.push_str(&format!(
            "<h3>{}</h3>\n<div class=\"plot\" id=\"plot-{index}\"></div>\n",
            html::escape(&figure.title)
        ));
    }
    content
        + "<noscript><p>The plots need JavaScript; everything else on this page does not.</p></noscript>\n"
}

/// The plot library as a script element; what typesets formulas comes after it and is left out.
fn plot_library() -> String {
    let mut scripts = Plot::offline_js_sources();
    if let Some(end) = scripts.find("</script>") {
        scripts.truncate(end + "</script>".len());
    }
    scripts.push('\n');
    scripts
}

/// The plot library as the file that pages with [`PlotLibrary::Beside`] load.
#[must_use]
pub fn plot_library_script() -> String {
    let element = plot_library();
    let begin = element.find('>').map_or(0, |end| end + 1);
    let end = element.rfind("</script>").unwrap_or(element.len());
    element.get(begin..end).unwrap_or_default().to_string()
}

fn scripts(figures: &[Figure]) -> String {
    // a figure holds only numbers, names and lists of them: it can always be written
    let json = serde_json::to_string(figures).unwrap_or_else(|_| "[]".to_string());
    let json = html::json_in_script(&json);
    let mut scripts = format!("<script type=\"application/json\" id=\"figures\">{json}</script>\n");
    for script in SCRIPTS {
        scripts.push_str(&format!("<script>\n{script}</script>\n"));
    }
    scripts
}
