//! What all figures share: the time axis, curves, and shaded events.

use plotly::Traces;
use plotly::color::Rgba;
use plotly::common::{Fill, HoverInfo, Line, Mode};
use plotly::layout::{Shape, ShapeLayer, ShapeLine, ShapeType};
use tipwatch_mechanics::Quantity;

use crate::analysis::Analysis;
use crate::events::{Event, EventKind};
use crate::page::{ColumnScatter, Columns, Figure, layout, line, plain};
use crate::report::findings::{Scene, rank};
use crate::report::sketch::{Curve, Sketch};

/// Most events shown in a figure, the most important ones.
pub(in crate::report) const MOST_EVENTS: usize = 100;

/// Room above a plot (pixels).
const ABOVE: usize = 32;

/// Draws the curves of one analysis.
pub(super) struct Plotter<'a> {
    pub(super) analysis: &'a Analysis,
    pub(super) sketch: &'a Sketch,
    /// The numbers of the curves.
    pub(super) columns: &'a Columns,
}

/// Title of a vertical axis: what it shows, and the unit.
pub(super) fn axis(what: &str, quantity: Quantity) -> String {
    format!("{what} [{}]", quantity.kind().unit)
}

impl Plotter<'_> {
    pub(super) fn seconds(&self, row: usize) -> f64 {
        (self.analysis.rows.seconds(row) * 1e6).round() / 1e6
    }

    pub(super) fn curve(&self, index: usize, name: &str, curve: Curve) -> Box<ColumnScatter> {
        let points = self.sketch.points(curve);
        let times: Vec<f64> = points.iter().map(|p| self.seconds(p.row())).collect();
        let values: Vec<f64> = points.iter().map(|p| p.values()[0]).collect();
        line(self.columns, index, name, &times, &values)
    }

    /// Whether a curve has any value.
    pub(super) fn is_known(&self, curve: Curve) -> bool {
        let mut points = self.sketch.points(curve).iter();
        points.any(|point| point.values()[0].is_finite())
    }

    /// The area between the two values of a curve, as a filled shape.
    pub(super) fn area(&self, name: &str, curve: Curve, fill: Rgba) -> Box<ColumnScatter> {
        let points = self.sketch.points(curve).iter();
        self.between(
            name,
            points.map(|p| (p.row(), p.values()[0], p.values()[1])),
            fill,
        )
    }

    /// The area between two curves, as a filled shape: rows with the value below and the one above.
    pub(super) fn between(
        &self,
        name: &str,
        points: impl Iterator<Item = (usize, f64, f64)>,
        fill: Rgba,
    ) -> Box<ColumnScatter> {
        let points: Vec<(usize, f64, f64)> = points.collect();
        let (mut times, mut values) = (Vec::new(), Vec::new());
        for run in points
            .split(|(_, low, high)| !(low.is_finite() && high.is_finite()))
            .filter(|run| !run.is_empty())
        {
            let there = run.iter().map(|&(row, _, high)| (row, high));
            let back = run.iter().rev().map(|&(row, low, _)| (row, low));
            for (row, value) in there.chain(back) {
                times.push(self.seconds(row));
                values.push(value);
            }
            times.push(self.seconds(run[run.len() - 1].0));
            values.push(f64::NAN);
        }
        (self.columns)
            .scatter(&times, &values)
            .name(name)
            .mode(Mode::Lines)
            .fill(Fill::ToSelf)
            .fill_color(fill)
            .line(Line::new().width(0.0))
            .hover_info(HoverInfo::Skip)
    }

    /// Whether the chosen model computes a quantity.
    pub(super) fn has(&self, quantity: Quantity) -> bool {
        self.analysis.rows.has(quantity)
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
        (self.analysis.rows.len().checked_sub(1)).map_or(0.0, |last| self.seconds(last))
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

fn tint(kind: EventKind) -> [u8; 3] {
    match kind {
        EventKind::TipOver => [150, 0, 0],
        EventKind::EdgeTipping => [213, 60, 0],
        EventKind::WheelLift => [230, 159, 0],
        EventKind::WheelLight => [240, 200, 60],
        EventKind::InputGap => [120, 120, 120],
        EventKind::InputFault => [120, 60, 160],
        EventKind::LiftNotExcluded => [170, 170, 120],
    }
}
