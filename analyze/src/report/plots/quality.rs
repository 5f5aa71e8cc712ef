//! The quality of the inputs over time: which signals were present, which were implausible, and which rows
//! are invalid and why.

use std::collections::BTreeMap;

use plotly::Traces;
use plotly::common::{Anchor, Font, HoverInfo, Line, Mode};
use plotly::layout::Annotation;

use super::plotter::Plotter;
use crate::events::EventKind;
use crate::page::{ColumnScatter, Figure, colour, plain, readable};

/// Height of a lane (pixels).
const LANE: usize = 34;
/// A span shorter than this share of the log is drawn this long, so that it can be seen.
const SHORTEST: f64 = 1.0 / 400.0;

/// Colours of the kinds of lanes.
const PRESENT: usize = 0;
const IMPLAUSIBLE: usize = 1;
const INVALID: usize = 4;

/// A lane of the figure.
pub(super) struct Lane {
    pub(super) name: String,
    pub(super) colour: usize,
    /// Start and end of what is drawn (s).
    pub(super) spans: Vec<(f64, f64)>,
}

impl Plotter<'_> {
    /// A lane for each input, interrupted where it is missing; one for each implausible signal; and one for
    /// each reason why rows are invalid.
    pub(super) fn quality(&self) -> Figure {
        let mut lanes = self.present();
        lanes.extend(self.implausible());
        lanes.extend(self.invalid());
        let title = "Input quality: signals present, implausible signals, invalid rows";
        self.lanes(title, &lanes)
    }

    /// A figure of lanes, each under its name.
    pub(super) fn lanes(&self, title: &str, lanes: &[Lane]) -> Figure {
        let mut traces = Traces::new();
        for (place, lane) in lanes.iter().enumerate() {
            traces.push(self.bar(place, lane));
        }
        let mut figure = self.figure(title, "", 64 + LANE * lanes.len(), traces);
        let label = |(place, lane): (usize, &Lane)| {
            Annotation::new()
                .text(&lane.name)
                .x_ref("paper")
                .x(0.0)
                .y_ref("y")
                .y(height(place))
                .y_shift(5.0)
                .x_anchor(Anchor::Left)
                .y_anchor(Anchor::Bottom)
                .show_arrow(false)
                .font(Font::new().size(12).color("#333"))
        };
        let axis = plotly::layout::Axis::new()
            .range(vec![height(lanes.len()) + 0.3, 0.9])
            .show_tick_labels(false)
            .show_grid(false)
            .zero_line(false)
            .fixed_range(true);
        figure.layout = (figure.layout)
            .show_legend(false)
            .y_axis(axis)
            .annotations(lanes.iter().enumerate().map(label).collect());
        figure
    }

    fn bar(&self, place: usize, lane: &Lane) -> Box<ColumnScatter> {
        let least = self.last_second() * SHORTEST;
        let (mut times, mut values) = (Vec::new(), Vec::new());
        for &(start, end) in &lane.spans {
            times.extend([start, end.max(start + least), end]);
            values.extend([height(place), height(place), f64::NAN]);
        }
        (self.columns)
            .scatter(&times, &values)
            .name(&lane.name)
            .mode(Mode::Lines)
            .connect_gaps(false)
            .hover_info(HoverInfo::Name)
            .line(Line::new().width(9.0).color(colour(lane.colour, 0.9)))
    }

    /// The inputs without their gaps.
    fn present(&self) -> Vec<Lane> {
        let last = self.last_second();
        let lane = |input: &crate::analysis::Input| {
            let gaps =
                self.analysis.events.iter().filter(|event| {
                    event.kind == EventKind::InputGap && event.subject == input.signal
                });
            let mut spans = Vec::new();
            let mut from = 0.0;
            for gap in gaps {
                let (start, end) = self.span(gap);
                if start > from {
                    spans.push((from, start));
                }
                from = end;
            }
            if from < last {
                spans.push((from, last));
            }
            Lane {
                name: plain(&format!("{}: {}", input.signal, input.topic)),
                colour: PRESENT,
                spans,
            }
        };
        self.analysis.inputs.iter().map(lane).collect()
    }

    fn implausible(&self) -> Vec<Lane> {
        let mut lanes: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
        for event in &self.analysis.events {
            if let Some(fault) = &event.fault {
                let name = format!("{}: {}", event.subject, readable(fault.kind.name()));
                lanes.entry(name).or_default().push(self.span(event));
            }
        }
        let lane = |(name, spans): (String, _)| Lane {
            name: plain(&name),
            colour: IMPLAUSIBLE,
            spans,
        };
        lanes.into_iter().map(lane).collect()
    }

    fn invalid(&self) -> Vec<Lane> {
        let rows = &self.analysis.rows;
        // for each reason the first and last rows of its spans
        let mut lanes: BTreeMap<&'static str, Vec<(usize, usize)>> = BTreeMap::new();
        for (row, reasons) in rows.reasons.iter().enumerate() {
            for reason in reasons.iter() {
                let spans = lanes.entry(reason.name()).or_default();
                match spans.last_mut() {
                    Some(span) if span.1 + 1 == row => span.1 = row,
                    _ => spans.push((row, row)),
                }
            }
        }
        let seconds = |&(from, to): &(usize, usize)| (rows.seconds(from), rows.seconds(to));
        let lane = |(name, spans): (&str, Vec<_>)| Lane {
            name: format!("invalid rows: {}", readable(name)),
            colour: INVALID,
            spans: spans.iter().map(seconds).collect(),
        };
        lanes.into_iter().map(lane).collect()
    }
}

/// Place of a lane on the vertical axis, the first on top.
fn height(place: usize) -> f64 {
    -(place as f64)
}
