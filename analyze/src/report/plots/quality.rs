//! The quality of the inputs over time: which signals were present, which were implausible, and which rows
//! are invalid and why.

use std::collections::BTreeMap;

use tipwatch_language::{say, word};

use super::plotter::{Part, Plotter};
use crate::events::EventKind;
use crate::page::{Figure, Look, Trace, input_in_words, readable};

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
        let title = word!("Input quality: signals present, implausible signals, invalid rows");
        self.lanes(Part::Inputs, title, &lanes)
    }

    /// A figure of lanes, each under its name.
    pub(super) fn lanes(&self, part: Part, title: &str, lanes: &[Lane]) -> Figure {
        let mut figure = self.figure(part, title, "", 34 + LANE * lanes.len());
        for (place, lane) in lanes.iter().enumerate() {
            figure.lane(&lane.name);
            figure.add(self.bar(place, lane));
        }
        figure
    }

    fn bar(&self, place: usize, lane: &Lane) -> Trace {
        let least = self.last_second() * SHORTEST;
        let (mut times, mut values) = (Vec::new(), Vec::new());
        for &(start, end) in &lane.spans {
            times.extend([start, end.max(start + least), end]);
            values.extend([height(place), height(place), f64::NAN]);
        }
        let bar = Trace::new(
            self.columns,
            Look::Bar,
            lane.colour,
            &lane.name,
            &times,
            &values,
        );
        bar.unnamed()
    }

    /// The inputs without their gaps.
    fn present(&self) -> Vec<Lane> {
        let last = self.last_second();
        let lane = |input: &crate::analysis::Input| {
            let gaps = self.analysis.events.iter().filter(|event| {
                event.kind == EventKind::InputGap && event.subject == input.subject
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
                name: format!("{}: {}", readable(input.signal), input.topic),
                colour: PRESENT,
                spans,
            }
        };
        self.analysis.inputs.iter().map(lane).collect()
    }

    fn implausible(&self) -> Vec<Lane> {
        let mut lanes: BTreeMap<(&str, &'static str), Vec<(f64, f64)>> = BTreeMap::new();
        for event in &self.analysis.events {
            if let Some(fault) = &event.fault {
                let key = (event.subject.as_str(), fault.kind.name());
                lanes.entry(key).or_default().push(self.span(event));
            }
        }
        let lane = |((subject, kind), spans): ((&str, _), _)| Lane {
            name: format!("{}: {}", input_in_words(subject), readable(kind)),
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
            name: say!("invalid rows: {}", readable(name)),
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
