//! What all figures share: the time axis, curves, and shaded events.

use plotly::Traces;
use plotly::color::Rgba;
use plotly::common::{Fill, HoverInfo, Line, Mode};
use plotly::layout::{Shape, ShapeLayer, ShapeLine, ShapeType};
use tipwatch_mechanics::Quantity;

use crate::analysis::Analysis;
use crate::events::{Event, EventKind};
use crate::page::{ColumnScatter, Figure, MOST_POINTS, layout, line, plain, rows_to_draw, scatter};
use crate::report::findings::{Scene, rank};

/// Points of a filled shape's edge, and of a curve that is hidden at first: the page stays small.
pub(super) const FEWER_POINTS: usize = 1000;
/// Most events shown in a figure, the most important ones.
pub(in crate::report) const MOST_EVENTS: usize = 100;

/// Room above a plot (pixels).
const ABOVE: usize = 32;

/// Draws the curves of one analysis.
pub(super) struct Plotter<'a> {
    pub(super) analysis: &'a Analysis,
    pub(super) seconds: Vec<f64>,
}

/// Title of a vertical axis: what it shows, and the unit.
pub(super) fn axis(what: &str, quantity: Quantity) -> String {
    format!("{what} [{}]", quantity.kind().unit)
}

impl<'a> Plotter<'a> {
    pub(super) fn new(analysis: &'a Analysis) -> Self {
        Self {
            analysis,
            seconds: seconds(analysis),
        }
    }

    /// A result in the rows whose loads are usable, else NaN.
    pub(super) fn valid(&self, quantity: Quantity) -> Vec<f64> {
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

    pub(super) fn curve(&self, index: usize, name: &str, values: &[f64]) -> Box<ColumnScatter> {
        self.curve_of(index, name, values, MOST_POINTS)
    }

    pub(super) fn curve_of(
        &self,
        index: usize,
        name: &str,
        values: &[f64],
        points: usize,
    ) -> Box<ColumnScatter> {
        line(index, name, &self.seconds, values, points)
    }

    /// The area between two curves, as a filled shape.
    pub(super) fn between(
        &self,
        name: &str,
        low: &[f64],
        high: &[f64],
        fill: Rgba,
    ) -> Box<ColumnScatter> {
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

    /// Whether the chosen model computes a quantity.
    pub(super) fn has(&self, quantity: Quantity) -> bool {
        self.analysis.rows.outcomes.quantities.contains(&quantity)
    }

    pub(super) fn wheel_names(&self) -> Vec<String> {
        let wheels = self.analysis.machine.wheels().iter();
        wheels.map(|wheel| plain(&wheel.name)).collect()
    }

    pub(super) fn figure(&self, title: &str, unit: &str, height: usize, traces: Traces) -> Figure {
        let events = shown(&self.analysis.events);
        let layout = layout(unit, height, ABOVE, self.last_second())
            .shapes(events.iter().map(|event| self.band(event)).collect());
        Figure::new(title, traces, layout)
    }

    pub(super) fn last_second(&self) -> f64 {
        self.seconds.last().copied().unwrap_or(0.0)
    }

    pub(super) fn span(&self, event: &Event) -> (f64, f64) {
        let scene = Scene::of(self.analysis);
        let last = self.last_second();
        (
            scene.seconds(event.start_ns),
            event.end_ns.map_or(last, |end_ns| scene.seconds(end_ns)),
        )
    }

    pub(super) fn band(&self, event: &Event) -> Shape {
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
}

/// The most important events, by time.
fn shown(events: &[Event]) -> Vec<&Event> {
    let mut shown: Vec<&Event> = events.iter().collect();
    shown.sort_by_key(|event| (rank(event.kind), event.start_ns));
    shown.truncate(MOST_EVENTS);
    shown.sort_by_key(|event| (event.start_ns, rank(event.kind)));
    shown
}

fn seconds(analysis: &Analysis) -> Vec<f64> {
    (0..analysis.rows.len())
        .map(|row| (analysis.rows.seconds(row) * 1e6).round() / 1e6)
        .collect()
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
