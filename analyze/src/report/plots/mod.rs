//! The figures of the page, all on one time axis: loads, indicators, causes, inputs.

mod causes;
mod chart;
mod column;
mod indicators;
mod inputs;
mod loads;
mod quality;
mod uncertainty;

use plotly::color::Rgba;
use plotly::common::{Anchor, DashType, Fill, Font, HoverInfo, Line, Mode, Orientation};
use plotly::configuration::DisplayModeBar;
use plotly::layout::{
    Annotation, Axis, HoverMode, Legend, Margin, Shape, ShapeLayer, ShapeLine, ShapeType,
};
use plotly::{Configuration, Layout, Traces};
use serde::Serialize;
use tipwatch_mechanics::Quantity;

pub(super) use chart::{Curve, chart};
use column::{ColumnScatter, scatter};

use super::decimate::rows_to_draw;
use super::findings::{Scene, rank};
use crate::analysis::Analysis;
use crate::events::{Event, EventKind};

/// What the ticks take below a plot (pixels).
const BELOW: usize = 32;
/// Points of a curve; a screen has fewer columns.
pub(super) const MOST_POINTS: usize = 4000;
/// Points of a filled shape's edge, and of a curve that is shown only on request: the page stays small.
const FEWER_POINTS: usize = 1000;
/// Most events shown in a figure, the most important ones.
pub(super) const MOST_EVENTS: usize = 100;
/// Colours that people of any colour vision tell apart on white (Okabe and Ito), as red, green, blue.
const COLOURS: [[u8; 3]; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [0, 0, 0],
    [86, 180, 233],
    [230, 159, 0],
];
/// Six patterns beside seven colours: the pair repeats only after 42 curves.
const DASHES: [DashType; 6] = [
    DashType::Solid,
    DashType::Dash,
    DashType::Dot,
    DashType::DashDot,
    DashType::LongDash,
    DashType::LongDashDot,
];

/// A figure as the plotting library takes it.
#[derive(Serialize)]
pub(super) struct Figure {
    /// Its heading on the page.
    #[serde(skip)]
    pub(super) title: String,
    #[serde(rename = "data")]
    traces: Traces,
    layout: Layout,
    config: Configuration,
}

/// All figures of the page, on one time axis.
pub(super) fn figures(analysis: &Analysis) -> Vec<Figure> {
    let plotter = Plotter {
        analysis,
        seconds: seconds(analysis),
    };
    let mut figures = vec![plotter.loads(), plotter.stability()];
    figures.extend(plotter.edges());
    figures.extend(plotter.causes());
    figures.extend(plotter.drawn_machines());
    figures.extend(plotter.inputs());
    figures.push(plotter.quality());
    figures
}

struct Plotter<'a> {
    analysis: &'a Analysis,
    seconds: Vec<f64>,
}

impl Plotter<'_> {
    /// A result where the row's loads mean something, else NaN.
    fn valid(&self, quantity: Quantity) -> Vec<f64> {
        let rows = &self.analysis.rows;
        let values = rows.outcomes.column(quantity).iter().zip(&rows.reasons);
        values
            .map(|(&value, reasons)| {
                if reasons.leave_loads() {
                    value
                } else {
                    f64::NAN
                }
            })
            .collect()
    }

    fn curve(&self, index: usize, name: &str, values: &[f64]) -> Box<ColumnScatter> {
        self.curve_of(index, name, values, MOST_POINTS)
    }

    fn curve_of(
        &self,
        index: usize,
        name: &str,
        values: &[f64],
        points: usize,
    ) -> Box<ColumnScatter> {
        line(index, name, &self.seconds, values, points)
    }

    /// What lies between two curves, as a filled shape.
    fn between(&self, name: &str, low: &[f64], high: &[f64], fill: Rgba) -> Box<ColumnScatter> {
        let mut rows = rows_to_draw(low, FEWER_POINTS);
        rows.extend(rows_to_draw(high, FEWER_POINTS));
        rows.sort_unstable();
        rows.dedup();
        let (mut times, mut values) = (Vec::new(), Vec::new());
        for run in rows
            .split(|&row| !(low[row].is_finite() && high[row].is_finite()))
            .filter(|run| !run.is_empty())
        {
            let there = run.iter().map(|&row| (row, high[row]));
            let back = run.iter().rev().map(|&row| (row, low[row]));
            for (row, value) in there.chain(back) {
                times.push(self.seconds[row]);
                values.push(value);
            }
            times.push(self.seconds[run[run.len() - 1]]);
            values.push(f64::NAN);
        }
        scatter(&times, &values)
            .name(name)
            .mode(Mode::Lines)
            .fill(Fill::ToSelf)
            .fill_color(fill)
            .line(Line::new().width(0.0))
            .hover_info(HoverInfo::Skip)
    }

    /// Whether the model that was chosen has a quantity.
    fn has(&self, quantity: Quantity) -> bool {
        self.analysis.rows.outcomes.quantities.contains(&quantity)
    }

    fn wheel_names(&self) -> Vec<String> {
        let wheels = self.analysis.machine.wheels().iter();
        wheels.map(|wheel| plain(&wheel.name)).collect()
    }

    fn figure(
        &self,
        title: &str,
        unit: &str,
        height: usize,
        traces: Traces,
        labels: bool,
    ) -> Figure {
        let top = if labels { 84 } else { 32 };
        let events = shown(&self.analysis.events);
        let mut layout = layout(unit, height, top, self.last_second())
            .shapes(events.iter().map(|event| self.band(event)).collect());
        if labels {
            layout = layout.annotations(self.labels(&events));
        }
        Figure {
            title: title.into(),
            traces,
            layout,
            config: config(),
        }
    }

    fn last_second(&self) -> f64 {
        self.seconds.last().copied().unwrap_or(0.0)
    }

    fn span(&self, event: &Event) -> (f64, f64) {
        let scene = Scene::of(self.analysis);
        let last = self.last_second();
        (
            scene.seconds(event.start_ns),
            event.end_ns.map_or(last, |end_ns| scene.seconds(end_ns)),
        )
    }

    fn band(&self, event: &Event) -> Shape {
        let (start, end) = self.span(event);
        let [red, green, blue] = tint(event.kind);
        Shape::new()
            .shape_type(ShapeType::Rect)
            .layer(ShapeLayer::Below)
            .x_ref("x")
            .y_ref("paper")
            .x0(start)
            .x1(end)
            .y0(0.0)
            .y1(1.0)
            .fill_color(Rgba::new(red, green, blue, 0.18))
            .line(
                ShapeLine::new()
                    .width(1.0)
                    .color(Rgba::new(red, green, blue, 0.6)),
            )
    }

    /// Labels above the plot in four lines, so that neighbours rarely cover each other.
    fn labels(&self, events: &[&Event]) -> Vec<Annotation> {
        let scene = Scene::of(self.analysis);
        let label = |(index, event): (usize, &&Event)| {
            let text = format!(
                "{} {}",
                event.kind.name().replace('_', " "),
                plain(&scene.subject(event))
            );
            Annotation::new()
                .text(text)
                .x_ref("x")
                .x(self.span(event).0)
                .y_ref("paper")
                .y(1.0)
                .y_shift(2.0 + 15.0 * (index % 4) as f64)
                .x_anchor(Anchor::Left)
                .y_anchor(Anchor::Bottom)
                .show_arrow(false)
                .font(Font::new().size(11).color("#333"))
        };
        events.iter().enumerate().map(label).collect()
    }
}

/// The most important events, by time.
fn shown(events: &[Event]) -> Vec<&Event> {
    let mut shown: Vec<&Event> = events.iter().collect();
    shown.sort_by_key(|event| (rank(event.kind), event.start_ns));
    shown.truncate(MOST_EVENTS);
    shown.sort_by_key(|event| (event.start_ns, rank(event.kind)));
    shown
}

/// A curve over the times of the rows (s), the same in every figure.
fn line(
    index: usize,
    name: &str,
    seconds: &[f64],
    values: &[f64],
    points: usize,
) -> Box<ColumnScatter> {
    let rows = rows_to_draw(values, points);
    let of_rows = |column: &[f64]| -> Vec<f64> { rows.iter().map(|&row| column[row]).collect() };
    scatter(&of_rows(seconds), &of_rows(values))
        .name(name)
        .mode(Mode::Lines)
        .connect_gaps(false)
        .line(
            Line::new()
                .width(1.8)
                .color(colour(index, 1.0))
                .dash(DASHES[index % DASHES.len()].clone()),
        )
}

/// Axes, margins and legend of every figure: of a height and with so much room above (pixels), up to the
/// last second.
fn layout(unit: &str, height: usize, above: usize, last: f64) -> Layout {
    Layout::new()
        .height(height)
        .auto_size(true)
        .margin(Margin::new().left(64).right(16).top(above).bottom(BELOW))
        .hover_mode(HoverMode::XUnified)
        .show_legend(true)
        .legend(legend(height - above - BELOW))
        .x_axis(
            Axis::new()
                .tick_suffix(" s")
                .range(vec![0.0, last.max(1e-3)])
                .grid_color("#e6e6e6")
                .zero_line(false)
                .hover_format(".3f"),
        )
        .y_axis(
            Axis::new()
                .title(unit)
                .grid_color("#e6e6e6")
                .zero_line_color("#999")
                .hover_format(".4~g"),
        )
        .plot_background_color("#fff")
}

/// Below the ticks of a plot of this height (pixels); the page makes room for its lines.
fn legend(plot_height: usize) -> Legend {
    let below = 24.0 / plot_height as f64;
    Legend::new()
        .orientation(Orientation::Horizontal)
        .x(0.0)
        .y(-below)
        .y_anchor(Anchor::Top)
        .x_anchor(Anchor::Left)
}

fn config() -> Configuration {
    Configuration::new()
        .responsive(true)
        .display_logo(false)
        .display_mode_bar(DisplayModeBar::Hover)
        .typeset_math(false)
        .show_link(false)
        .plotly_server_url("")
}

fn seconds(analysis: &Analysis) -> Vec<f64> {
    (0..analysis.rows.len())
        .map(|row| (analysis.rows.seconds(row) * 1e6).round() / 1e6)
        .collect()
}

/// The library reads some markup in names; a name means only itself.
fn plain(name: &str) -> String {
    name.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace("%{", "% {")
}

fn colour(index: usize, opacity: f64) -> Rgba {
    let [red, green, blue] = COLOURS[index % COLOURS.len()];
    Rgba::new(red, green, blue, opacity)
}

fn tint(kind: EventKind) -> [u8; 3] {
    match kind {
        EventKind::TipOver => [150, 0, 0],
        EventKind::EdgeTipping => [213, 60, 0],
        EventKind::WheelLift => [230, 159, 0],
        EventKind::WheelLight => [240, 200, 60],
        EventKind::InputGap => [120, 120, 120],
        EventKind::InputFault => [120, 60, 160],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_carry_no_markup() {
        assert_eq!(plain("<a href='x'>&"), "&lt;a href='x'&gt;&amp;");
    }
}
