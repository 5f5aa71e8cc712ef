//! A figure of curves over time.

use super::column::Columns;
use super::decimate::rows_to_draw;
use super::figure::{Figure, MOST_POINTS, Trace};

const HEIGHT: usize = 240;

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
    let mut figure = Figure::new(title, unit, HEIGHT, last);
    for (index, curve) in curves.iter().enumerate() {
        let rows = rows_to_draw(&curve.values, MOST_POINTS);
        let of_rows =
            |column: &[f64]| -> Vec<f64> { rows.iter().map(|&row| column[row]).collect() };
        let (times, values) = (of_rows(seconds), of_rows(&curve.values));
        figure.add(Trace::line(columns, index, &curve.name, &times, &values));
    }
    figure
}
