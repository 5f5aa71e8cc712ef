//! A figure of curves over time.

use plotly::Traces;

use super::column::Columns;
use super::decimate::rows_to_draw;
use super::figure::{Figure, MOST_POINTS, layout, line, plain};

const HEIGHT: usize = 300;
/// Room above the plot (pixels).
const ABOVE: usize = 24;

/// A named curve with one value per row.
pub(crate) struct Curve {
    name: String,
    values: Vec<f64>,
}

impl Curve {
    pub(crate) fn new(name: &str, values: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            values,
        }
    }
}

/// A figure of curves over the times of the rows (s).
pub(crate) fn chart(
    columns: &Columns,
    title: &str,
    unit: &str,
    seconds: &[f64],
    curves: &[Curve],
) -> Figure {
    let last = seconds.last().copied().unwrap_or(0.0);
    let mut traces = Traces::new();
    for (index, curve) in curves.iter().enumerate() {
        let name = plain(&curve.name);
        let rows = rows_to_draw(&curve.values, MOST_POINTS);
        let of_rows =
            |column: &[f64]| -> Vec<f64> { rows.iter().map(|&row| column[row]).collect() };
        traces.push(line(
            columns,
            index,
            &name,
            &of_rows(seconds),
            &of_rows(&curve.values),
        ));
    }
    Figure::new(title, traces, layout(unit, HEIGHT, ABOVE, last))
}
