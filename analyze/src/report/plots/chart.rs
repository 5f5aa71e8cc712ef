//! A figure of curves over time that belong to no analysis.

use plotly::common::{Line, Mode};
use plotly::layout::{Axis, HoverMode, Margin};
use plotly::{Layout, Scatter, Traces};

use super::{DASHES, Figure, MOST_POINTS, colour, config, drawn, legend, plain, rows_to_draw};

const HEIGHT: usize = 300;

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
    let last = seconds.last().copied().unwrap_or(0.0).max(1e-3);
    let mut traces = Traces::new();
    for (index, curve) in curves.iter().enumerate() {
        let rows = rows_to_draw(&curve.values, MOST_POINTS);
        let times = rows.iter().map(|&row| seconds[row]).collect();
        let values = rows.iter().map(|&row| drawn(curve.values[row])).collect();
        traces.push(
            Scatter::<f64, Option<f64>>::new(times, values)
                .name(plain(&curve.name))
                .mode(Mode::Lines)
                .connect_gaps(false)
                .line(
                    Line::new()
                        .width(1.8)
                        .color(colour(index, 1.0))
                        .dash(DASHES[index % DASHES.len()].clone()),
                ),
        );
    }
    let layout = Layout::new()
        .height(HEIGHT)
        .auto_size(true)
        .margin(Margin::new().left(64).right(16).top(24).bottom(32))
        .hover_mode(HoverMode::XUnified)
        .show_legend(true)
        .legend(legend(HEIGHT))
        .x_axis(
            Axis::new()
                .tick_suffix(" s")
                .range(vec![0.0, last])
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
        .plot_background_color("#fff");
    Figure {
        title: title.into(),
        traces,
        layout,
        config: config(),
    }
}
