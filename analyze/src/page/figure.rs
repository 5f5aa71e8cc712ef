//! Figures: what they look like, and their places on the page.

use maud::{Markup, html};
use plotly::color::Rgba;
use plotly::common::{Anchor, DashType, Line, Mode, Orientation};
use plotly::configuration::DisplayModeBar;
use plotly::layout::{Axis, HoverMode, Legend, Margin};
use plotly::{Configuration, Layout, Traces};
use serde::Serialize;

use super::column::{ColumnScatter, Columns};

/// Height of the ticks below a plot (pixels).
const BELOW: usize = 32;
/// Points of a curve; a screen has fewer columns.
pub(crate) const MOST_POINTS: usize = 3000;
/// Colours that people with any colour vision can distinguish on white (Okabe and Ito), as red, green, blue.
const COLOURS: [[u8; 3]; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [0, 0, 0],
    [86, 180, 233],
    [230, 159, 0],
];
/// Six dash patterns and seven colours: a pair repeats only after 42 curves.
const DASHES: [DashType; 6] = [
    DashType::Solid,
    DashType::Dash,
    DashType::Dot,
    DashType::DashDot,
    DashType::LongDash,
    DashType::LongDashDot,
];

/// A figure as the plot library reads it.
#[derive(Serialize)]
pub(crate) struct Figure {
    /// Its heading on the page.
    #[serde(skip)]
    title: String,
    #[serde(rename = "data")]
    traces: Traces,
    pub(crate) layout: Layout,
    config: Configuration,
}

impl Figure {
    pub(crate) fn new(title: &str, traces: Traces, layout: Layout) -> Self {
        Self {
            title: title.into(),
            traces,
            layout,
            config: config(),
        }
    }
}

/// The places of the figures on the page; a script draws them there.
pub(crate) fn figures(figures: &[Figure]) -> Markup {
    html! {
        p.hint.screen {
            "Drag to zoom, double-click to reset; all plots share the time axis. "
            "Click a name below a plot to show or hide its curve."
        }
        @for (index, figure) in figures.iter().enumerate() {
            h3 { (figure.title) }
            div.plot id=(format_args!("plot-{index}")) {}
        }
        noscript { p { "The plots need JavaScript; the rest of this page does not." } }
    }
}

/// A curve over times (s).
pub(crate) fn line(
    columns: &Columns,
    index: usize,
    name: &str,
    seconds: &[f64],
    values: &[f64],
) -> Box<ColumnScatter> {
    columns
        .scatter(seconds, values)
        .name(name)
        .mode(Mode::Lines)
        .connect_gaps(false)
        .line(
            Line::new()
                .width(1.8)
                .color(colour(index, 1.0))
                .dash(DASHES[index % DASHES.len()].clone()),
        )
}

/// Axes, margins and legend of every figure: of a height and with so much room above (pixels), up to the
/// last second.
pub(crate) fn layout(unit: &str, height: usize, above: usize, last: f64) -> Layout {
    Layout::new()
        .height(height)
        .auto_size(true)
        .margin(Margin::new().left(64).right(16).top(above).bottom(BELOW))
        .hover_mode(HoverMode::XUnified)
        .show_legend(true)
        .legend(legend(height - above - BELOW))
        .x_axis(
            Axis::new()
                .tick_suffix(" s")
                .range(vec![0.0, last.max(1e-3)])
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
        .plot_background_color("#fff")
}

/// Below the ticks of a plot of this height (pixels); the page makes room for its lines.
fn legend(plot_height: usize) -> Legend {
    let below = 24.0 / plot_height as f64;
    Legend::new()
        .orientation(Orientation::Horizontal)
        .x(0.0)
        .y(-below)
        .y_anchor(Anchor::Top)
        .x_anchor(Anchor::Left)
}

fn config() -> Configuration {
    Configuration::new()
        .responsive(true)
        .display_logo(false)
        .display_mode_bar(DisplayModeBar::Hover)
        .typeset_math(false)
        .show_link(false)
        .plotly_server_url("")
}

/// A name without the markup that the plot library would read in it.
pub(crate) fn plain(name: &str) -> String {
    name.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace("%{", "% {")
}

pub(crate) fn colour(index: usize, opacity: f64) -> Rgba {
    let [red, green, blue] = COLOURS[index % COLOURS.len()];
    Rgba::new(red, green, blue, opacity)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_carry_no_markup() {
        assert_eq!(plain("<a href='x'>&"), "&lt;a href='x'&gt;&amp;");
    }
}
