//! Common parts of all figures: the time axis, curves, and shaded events.

use tipwatch_mechanics::Quantity;

use crate::analysis::Analysis;
use crate::events::{Event, EventKind};
use crate::page::{Columns, Figure, Look, Trace};
use crate::report::findings::Scene;
use crate::report::sketch::{Curve, Sketch};

/// Most events shown in a figure, the most important ones.
pub(in crate::report) const MOST_EVENTS: usize = 100;

/// The parts of the page that have figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub(in crate::report) enum Part {
    Events,
    Loads,
    Causes,
    Indicators,
    Inputs,
    Study,
}

impl Part {
    pub(in crate::report) fn name(self) -> &'static str {
        self.into()
    }
}

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

    pub(super) fn curve(&self, index: usize, name: &str, curve: Curve) -> Trace {
        let points = self.sketch.points(curve);
        let times: Vec<f64> = points.iter().map(|p| self.seconds(p.row())).collect();
        let values: Vec<f64> = points.iter().map(|p| p.values()[0]).collect();
        Trace::line(self.columns, index, name, &times, &values)
    }

    /// Whether a curve has any value.
    pub(super) fn is_known(&self, curve: Curve) -> bool {
        let mut points = self.sketch.points(curve).iter();
        points.any(|point| point.values()[0].is_finite())
    }

    /// The area between the two values of a curve, as a filled shape.
    pub(super) fn area(&self, look: Look, index: usize, name: &str, curve: Curve) -> Trace {
        let points = self.sketch.points(curve).iter();
        let points = points.map(|p| (p.row(), p.values()[0], p.values()[1]));
        self.between(look, index, name, points)
    }

    /// The area between two curves, as a filled shape: rows with the value below and the one above.
    pub(super) fn between(
        &self,
        look: Look,
        index: usize,
        name: &str,
        points: impl Iterator<Item = (usize, f64, f64)>,
    ) -> Trace {
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
        Trace::new(self.columns, look, index, name, &times, &values)
    }

    /// Whether the chosen model computes a quantity.
    pub(super) fn has(&self, quantity: Quantity) -> bool {
        self.analysis.rows.has(quantity)
    }

    pub(super) fn wheel_names(&self) -> Vec<String> {
        let wheels = self.analysis.machine.wheels().iter();
        wheels.map(|wheel| wheel.name.clone()).collect()
    }

    /// An empty figure of a part of the page.
    pub(super) fn figure(&self, part: Part, title: &str, unit: &str, height: usize) -> Figure {
        let mut figure = Figure::new(title, unit, height, self.last_second());
        figure.part = part.name();
        figure
    }

    /// Shades the times of the events in a figure and in those behind it.
    pub(super) fn shade_events(&self, figure: &mut Figure) {
        for event in shown(&self.analysis.events) {
            let (start, end) = self.span(event);
            figure.shade([start, end], tint(event.kind));
        }
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
}

/// The most important events, by time.
fn shown(events: &[Event]) -> Vec<&Event> {
    let mut shown: Vec<&Event> = events.iter().collect();
    shown.sort_by_key(|event| event.importance());
    shown.truncate(MOST_EVENTS);
    shown.sort_by_key(|event| (event.start_ns, event.kind.rank()));
    shown
}

/// Class of the shade of a kind.
fn tint(kind: EventKind) -> &'static str {
    match kind {
        EventKind::TipOver | EventKind::EdgeTipping => "tip",
        EventKind::WheelLift => "lift",
        EventKind::WheelLight => "light",
        EventKind::InputGap | EventKind::InputFault | EventKind::LiftNotExcluded => "input",
    }
}
