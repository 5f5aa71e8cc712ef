//! The figures of the report, all on one time axis: loads, indicators, contributions, inputs.

mod causes;
mod indicators;
mod inputs;
mod loads;
mod quality;
mod uncertainty;

use plotly::Traces;
use plotly::color::Rgba;
use plotly::common::{Anchor, Fill, Font, HoverInfo, Line, Mode};
use plotly::layout::{Annotation, Shape, ShapeLayer, ShapeLine, ShapeType};
use tipwatch_mechanics::Quantity;

use super::findings::{Scene, rank};
use crate::analysis::Analysis;
use crate::events::{Event, EventKind};
use crate::page::{
    ColumnScatter, Figure, MOST_POINTS, layout, line, plain, rows_to_draw, scatter, words,
};

/// Points of a filled shape's edge, and of a curve that is hidden at first: the page stays small.
const FEWER_POINTS: usize = 1000;
/// Most events shown in a figure, the most important ones.
pub(super) const MOST_EVENTS: usize = 100;

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

/// Title of a vertical axis: what it shows, and the unit.
fn axis(what: &str, quantity: Quantity) -> String {
    format!("{what} [{}]", quantity.kind().unit)
}

impl Plotter<'_> {
    /// A result in the rows whose loads are usable, else NaN.
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

    /// The area between two curves, as a filled shape.
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

    /// Whether the chosen model computes a quantity.
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
        Figure::new(title, traces, layout)
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
                words(event.kind.name()),
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
