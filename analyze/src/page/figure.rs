//! Figures: curves, areas and points over time, and their places on the page. `figures.js` draws them.

use maud::{Markup, html};
use serde::Serialize;
use tipwatch_language::word;

use super::column::{Column, Columns};
use super::svg::course;

/// Points of a curve; a screen has fewer columns.
pub(crate) const MOST_POINTS: usize = 3000;

/// A figure over the common time axis of a page.
#[derive(Debug, Serialize)]
pub(crate) struct Figure {
    /// Its heading on the page.
    pub(crate) title: String,
    /// The part of the page that shows it.
    #[serde(skip)]
    pub(crate) part: &'static str,
    /// Quantity of the vertical axis, with its unit.
    unit: String,
    /// Height of the plot without its legend (pixels).
    height: usize,
    /// Start and end of the time axis (s).
    span: [f64; 2],
    traces: Vec<Trace>,
    /// Times that are shaded in all figures of the page; those of its first figure alone are read.
    bands: Vec<Band>,
    /// Horizontal lines.
    limits: Vec<Limit>,
    /// Names of lanes, the first on top; with lanes there is no vertical axis.
    lanes: Vec<String>,
}

/// Look of a trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Look {
    Line,
    /// The shape within a closed line.
    Area,
    /// A pale shape, behind everything else.
    Envelope,
    Points,
    /// A thick line along a lane.
    Bar,
}

/// One curve, area or set of points.
#[derive(Debug, Serialize)]
pub(crate) struct Trace {
    name: String,
    look: Look,
    /// Index into the palette of the page.
    colour: usize,
    /// Index of the dash pattern; 0 is solid.
    dash: usize,
    /// Whether the trace is hidden until a reader asks for it.
    hidden: bool,
    /// Whether the trace has a place in the legend.
    named: bool,
    /// Whether areas carry a pattern, so that they can be told apart without colour.
    hatched: bool,
    /// Its course in words.
    #[serde(skip)]
    told: Option<String>,
    x: Column,
    y: Column,
}

#[derive(Debug, Serialize)]
struct Band {
    from: f64,
    to: f64,
    kind: &'static str,
}

#[derive(Debug, Serialize)]
struct Limit {
    at: f64,
    name: String,
}

impl Figure {
    /// An empty figure over the time up to the last second.
    pub(crate) fn new(title: &str, unit: &str, height: usize, last_s: f64) -> Self {
        Self {
            title: title.into(),
            part: "",
            unit: unit.into(),
            height,
            span: [0.0, last_s.max(1e-3)],
            traces: Vec::new(),
            bands: Vec::new(),
            limits: Vec::new(),
            lanes: Vec::new(),
        }
    }

    pub(crate) fn add(&mut self, trace: Trace) {
        self.traces.push(trace);
    }

    /// Shades a time in all figures of a page, of which this is the first; `kind` is a class of the style sheet.
    pub(crate) fn shade(&mut self, [from, to]: [f64; 2], kind: &'static str) {
        self.bands.push(Band { from, to, kind });
    }

    /// A horizontal line at a value.
    pub(crate) fn limit(&mut self, at: f64, name: &str) {
        self.limits.push(Limit {
            at,
            name: name.into(),
        });
    }

    pub(crate) fn lane(&mut self, name: &str) {
        self.lanes.push(name.into());
    }

    /// Describes the figure for readers who do not see it: its title, and the course of the curves that are drawn at first.
    fn told(&self) -> String {
        let shown = self.traces.iter().filter(|trace| !trace.hidden);
        let curves = shown.filter_map(|trace| trace.told.as_deref());
        let told: Vec<&str> = curves
            .chain(self.lanes.iter().map(String::as_str))
            .collect();
        format!("{}: {}", self.title, told.join("; "))
    }

    pub(crate) fn has_traces(&self) -> bool {
        !self.traces.is_empty()
    }
}

impl Trace {
    /// A curve over times (s).
    pub(crate) fn line(
        columns: &Columns,
        index: usize,
        name: &str,
        seconds: &[f64],
        values: &[f64],
    ) -> Self {
        Self::new(columns, Look::Line, index, name, seconds, values)
    }

    pub(crate) fn new(
        columns: &Columns,
        look: Look,
        colour: usize,
        name: &str,
        seconds: &[f64],
        values: &[f64],
    ) -> Self {
        let (x, y) = columns.curve(seconds, values);
        let points = || seconds.iter().copied().zip(values.iter().copied());
        Self {
            told: (look == Look::Line).then(|| course(name, &points().collect::<Vec<_>>())),
            name: name.into(),
            look,
            colour,
            dash: if look == Look::Line { colour } else { 0 },
            hidden: false,
            named: true,
            hatched: false,
            x,
            y,
        }
    }

    /// Without a dash pattern.
    pub(crate) fn solid(self) -> Self {
        Self { dash: 0, ..self }
    }

    /// Hidden until a reader asks for it.
    pub(crate) fn hidden(self, hidden: bool) -> Self {
        Self { hidden, ..self }
    }

    /// Without a place in the legend: the trace before it of the same name has it.
    pub(crate) fn unnamed(self) -> Self {
        Self {
            named: false,
            ..self
        }
    }

    pub(crate) fn hatched(self) -> Self {
        Self {
            hatched: true,
            ..self
        }
    }
}

/// The places of the figures of a part of the page; a script draws them there.
pub(crate) fn figures(figures: &[Figure], part: &str) -> Markup {
    let shown = figures
        .iter()
        .enumerate()
        .filter(|(_, figure)| figure.part == part);
    html! {
        div.plots {
            @for (index, figure) in shown {
                figure.plot-frame {
                    figcaption { (figure.title) }
                    div.plot id=(format_args!("plot-{index}")) tabindex="0" role="img"
                        aria-label=(figure.told())
                        style=(format_args!("min-height:{}px", figure.height)) {}
                }
            }
        }
    }
}

/// Renders the help on the figures, once for a page, with the texts of their script.
pub(crate) fn figures_help() -> Markup {
    html! {
        p.hint.screen id="plots-help" data-unknown=(word!("unknown"))
            data-old=(word!("This browser cannot unpack the figures: it is older than 2023.")) {
            (word!("Drag in a plot to zoom, double-click to see all; all plots share the time axis. With the keyboard: arrows move, \
            + and - zoom, 0 shows all. A name below a plot shows or hides its curve."))
        }
        noscript { p { (word!("The plots need JavaScript; the rest of this page does not.")) } }
    }
}
