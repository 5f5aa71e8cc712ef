//! Small charts as SVG.

use std::fmt::Write;

use crate::page::html::escape;

/// How charts look.
pub(crate) const CHART_STYLE: &str = include_str!("svg.css");
/// Size of a chart's drawing area and what lies around it, in its own units.
const WIDTH: f64 = 340.0;
const HEIGHT: f64 = 170.0;
const LEFT: f64 = 38.0;
const RIGHT: f64 = 8.0;
const TOP: f64 = 8.0;
const BOTTOM: f64 = 34.0;

/// A chart with axes; numbers outside its ranges are drawn at its edge.
pub(crate) struct Chart {
    x: (f64, f64),
    y: (f64, f64),
    body: String,
    title: String,
}

impl Chart {
    pub(crate) fn new(title: &str, x: (f64, f64), y: (f64, f64)) -> Self {
        Self {
            x,
            y,
            body: String::new(),
            title: title.into(),
        }
    }

    fn at_x(&self, x: f64) -> f64 {
        let share = ((x - self.x.0) / (self.x.1 - self.x.0)).clamp(0.0, 1.0);
        LEFT + share * (WIDTH - LEFT - RIGHT)
    }

    fn at_y(&self, y: f64) -> f64 {
        let share = ((y - self.y.0) / (self.y.1 - self.y.0)).clamp(0.0, 1.0);
        HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM)
    }

    pub(crate) fn bar(&mut self, from: f64, to: f64, height: f64, class: &str, told: &str) {
        let (left, right) = (self.at_x(from), self.at_x(to));
        let top = self.at_y(height);
        let _ = writeln!(
            self.body,
            "<rect class=\"{class}\" x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\"><title>{}</title></rect>",
            (right - left - 1.0).max(0.5),
            HEIGHT - BOTTOM - top,
            escape(told)
        );
    }

    pub(crate) fn whisker(&mut self, x: f64, low: f64, high: f64) {
        let x = self.at_x(x);
        let (low, high) = (self.at_y(low), self.at_y(high));
        let _ = writeln!(
            self.body,
            "<line class=\"whisker\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{low:.1}\" y2=\"{high:.1}\"/>"
        );
    }

    pub(crate) fn dot(&mut self, x: f64, y: f64, class: &str, told: &str) {
        let (x, y) = (self.at_x(x), self.at_y(y));
        let _ = writeln!(
            self.body,
            "<circle class=\"dot {class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.8\"><title>{}</title></circle>",
            escape(told)
        );
    }

    /// A line through points; one that is not finite breaks it.
    pub(crate) fn line(&mut self, points: &[(f64, f64)], class: &str) {
        let whole = |(x, y): &(f64, f64)| x.is_finite() && y.is_finite();
        for run in points
            .split(|point| !whole(point))
            .filter(|run| !run.is_empty())
        {
            self.run(run, class);
        }
    }

    fn run(&mut self, points: &[(f64, f64)], class: &str) {
        let at = |&(x, y): &(f64, f64)| format!("{:.1},{:.1}", self.at_x(x), self.at_y(y));
        let points: Vec<String> = points.iter().map(at).collect();
        let _ = writeln!(
            self.body,
            "<polyline class=\"{class}\" points=\"{}\"/>",
            points.join(" ")
        );
    }

    /// A dashed line across at a value.
    pub(crate) fn guide(&mut self, y: f64) {
        let y = self.at_y(y);
        let _ = writeln!(
            self.body,
            "<line class=\"guide\" x1=\"{LEFT}\" x2=\"{}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>",
            WIDTH - RIGHT
        );
    }

    /// A dashed line upwards at a value.
    pub(crate) fn guide_up(&mut self, x: f64) {
        let x = self.at_x(x);
        let _ = writeln!(
            self.body,
            "<line class=\"guide\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{TOP}\" y2=\"{}\"/>",
            HEIGHT - BOTTOM
        );
    }

    pub(crate) fn label_x(&mut self, x: f64, text: &str) {
        let x = self.at_x(x);
        let anchor = match x {
            x if x < LEFT + 20.0 => "start",
            x if x > WIDTH - RIGHT - 20.0 => "end",
            _ => "middle",
        };
        let _ = writeln!(
            self.body,
            "<text x=\"{x:.1}\" y=\"{}\" text-anchor=\"{anchor}\">{}</text>",
            HEIGHT - BOTTOM + 14.0,
            escape(text)
        );
    }

    pub(crate) fn label_y(&mut self, y: f64, text: &str) {
        let _ = writeln!(
            self.body,
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            LEFT - 4.0,
            self.at_y(y) + 4.0,
            escape(text)
        );
    }

    /// What the horizontal axis is.
    pub(crate) fn caption_x(&mut self, text: &str) {
        let _ = writeln!(
            self.body,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            LEFT + (WIDTH - LEFT - RIGHT) / 2.0,
            HEIGHT - 5.0,
            escape(text)
        );
    }

    pub(crate) fn finish(self) -> String {
        let (floor, right) = (HEIGHT - BOTTOM, WIDTH - RIGHT);
        format!(
            "<figure><figcaption>{title}</figcaption>\n<svg class=\"chart\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{title}\">\n\
             {body}<line class=\"axis\" x1=\"{LEFT}\" x2=\"{right}\" y1=\"{floor}\" y2=\"{floor}\"/>\n\
             <line class=\"axis\" x1=\"{LEFT}\" x2=\"{LEFT}\" y1=\"{TOP}\" y2=\"{floor}\"/>\n</svg></figure>\n",
            title = escape(&self.title),
            body = self.body
        )
    }
}

/// A number with its band on an axis from 0 to 1, for a line of text.
pub(crate) fn margin_bar(margin: f64, two_sigma: Option<f64>) -> String {
    let at = |share: f64| 6.0 + 120.0 * ((share + 0.2) / 1.2).clamp(0.0, 1.0);
    let (zero, place) = (at(0.0), at(margin));
    let band = two_sigma.map_or(String::new(), |sigma| {
        format!(
            "<line class=\"whisker\" x1=\"{:.1}\" x2=\"{:.1}\" y1=\"8\" y2=\"8\"/>",
            at(margin - sigma),
            at(margin + sigma)
        )
    });
    format!(
        "<svg width=\"132\" height=\"16\" viewBox=\"0 0 132 16\" role=\"img\" aria-label=\"{:.1} %\">\
         <line class=\"axis\" x1=\"{zero}\" x2=\"{zero}\" y1=\"1\" y2=\"15\"/>\
         <line class=\"guide\" x1=\"126\" x2=\"126\" y1=\"1\" y2=\"15\"/>{band}\
         <circle class=\"dot{}\" cx=\"{place:.1}\" cy=\"8\" r=\"3\"/></svg>",
        100.0 * margin,
        if margin <= 0.0 { " event" } else { "" }
    )
}

/// The next number of the series 1, 2, 5, 10, 20, ... for the end of an axis.
pub(crate) fn round_up(value: f64) -> f64 {
    if !(value > 0.0) {
        return 1.0;
    }
    let power = 10f64.powf(value.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * power);
    steps
        .into_iter()
        .find(|&step| step >= value)
        .unwrap_or(value)
}
