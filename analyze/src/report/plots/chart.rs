//! A figure of curves over time that belong to no analysis.

use plotly::Traces;

use super::{Figure, MOST_POINTS, config, layout, line, plain};

const HEIGHT: usize = 300;
/// Room above the plot (pixels).
const ABOVE: usize = 24;

/// A named curve, a value a row.
pub(in crate::report) struct Curve {
    name: String,
    values: Vec<f64>,
}

impl Curve {
    pub(in crate::report) fn new(name: &str, values: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            values,
        }
    }
}

/// A figure of curves over the times of the rows (s).
pub(in crate::report) fn chart(
    title: &str,
    unit: &str,
    seconds: &[f64],
    curves: &[Curve],
) -> Figure {
    let last = seconds.last().copied().unwrap_or(0.0);
    let mut traces = Traces::new();
    for (index, curve) in curves.iter().enumerate() {
        let name = plain(&curve.name);
        traces.push(line(index, &name, seconds, &curve.values, MOST_POINTS));
    }
    Figure {
        title: title.into(),
        traces,
        layout: layout(unit, HEIGHT, ABOVE, last),
        config: config(),
    }
}
