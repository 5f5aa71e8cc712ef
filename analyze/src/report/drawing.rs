//! Pictures to scale as SVG: metres in, one scale for both axes. The style is by class.

use maud::{Markup, html};
use tipwatch_language::decimals;

/// Width of a picture, in its own units.
const WIDTH: f64 = 360.0;
/// Height of letters, in the same units: 5.2 points or more in a picture that is 52 mm wide, as on the printed first page.
const LETTERS: f64 = 13.0;
/// Room around what is drawn, for labels and dimensions: at either side, above and below.
const BESIDE: f64 = 64.0;
const ABOVE: f64 = 16.0;
const BELOW: f64 = 52.0;
/// Largest height of a picture, in the same units.
const TALLEST: f64 = 258.0;

/// Width of a letter as a share of its height, on the wide side.
const LETTER_WIDTH: f64 = 0.62;
/// Shifts of a label up or down (the picture's own units), the nearest first.
const MOVES: [f64; 9] = [0.0, 12.0, -12.0, 24.0, -24.0, 36.0, -36.0, 48.0, -48.0];

/// A point (m): to the right and up in the picture.
pub(super) type Point = [f64; 2];

/// Which end of a text is at its point.
#[derive(Debug, Clone, Copy)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// A picture that grows element by element.
pub(super) struct Drawing {
    left: f64,
    top: f64,
    scale: f64,
    size: Point,
    body: Vec<Markup>,
}

impl Drawing {
    /// A picture on which all points have room; `None` if there are none, or not all are finite.
    pub(super) fn around(points: &[Point]) -> Option<Self> {
        let finite = points
            .iter()
            .all(|point| point.iter().all(|c| c.is_finite()));
        if points.is_empty() || !finite {
            return None;
        }
        let span = |axis: usize| {
            let along = || points.iter().map(|point| point[axis]);
            let (low, high) = (
                along().fold(f64::INFINITY, f64::min),
                along().fold(f64::NEG_INFINITY, f64::max),
            );
            (low, (high - low).max(0.1))
        };
        let ((left, width), (bottom, height)) = (span(0), span(1));
        let scale = ((WIDTH - 2.0 * BESIDE) / width).min((TALLEST - ABOVE - BELOW) / height);
        // what is less wide than the picture stands in its middle
        let free = (WIDTH - 2.0 * BESIDE) / scale - width;
        Some(Self {
            left: left - free / 2.0,
            top: bottom + height,
            scale,
            size: [WIDTH, ABOVE + height * scale + BELOW],
            body: Vec::new(),
        })
    }

    fn at(&self, [x, y]: Point) -> Point {
        [
            BESIDE + (x - self.left) * self.scale,
            ABOVE + (self.top - y) * self.scale,
        ]
    }

    /// Metres of a length in the picture's own units.
    pub(super) fn metres(&self, units: f64) -> f64 {
        units / self.scale
    }

    pub(super) fn line(&mut self, class: &str, from: Point, to: Point) {
        let ([x1, y1], [x2, y2]) = (self.at(from), self.at(to));
        self.body.push(html! {
            line class=(class) x1=(tenth(x1)) y1=(tenth(y1)) x2=(tenth(x2)) y2=(tenth(y2)) {}
        });
    }

    pub(super) fn circle(&mut self, class: &str, centre: Point, radius: f64) {
        let [x, y] = self.at(centre);
        let radius = tenth(radius * self.scale);
        self.body
            .push(html! { circle class=(class) cx=(tenth(x)) cy=(tenth(y)) r=(radius) {} });
    }

    pub(super) fn polygon(&mut self, class: &str, corners: &[Point]) {
        let points = self.pairs(corners);
        self.body
            .push(html! { polygon class=(class) points=(points) {} });
    }

    /// A line through several points. What moves by less than a tenth of the picture's own units is not drawn.
    pub(super) fn polyline(&mut self, class: &str, points: &[Point]) {
        let points = self.pairs(points);
        self.body
            .push(html! { polyline class=(class) points=(points) {} });
    }

    /// The points of a shape, one of several equal neighbours.
    fn pairs(&self, points: &[Point]) -> String {
        let pairs = points.iter().map(|&point| {
            let [x, y] = self.at(point);
            format!("{},{}", tenth(x), tenth(y))
        });
        let mut pairs: Vec<String> = pairs.collect();
        pairs.dedup();
        pairs.join(" ")
    }

    /// A label of one line or two beside a point, moved so many of the picture's own units to the right and up.
    pub(super) fn label(&mut self, at: Point, shift: Point, anchor: Anchor, lines: [&str; 2]) {
        for (line, text) in lines
            .into_iter()
            .enumerate()
            .filter(|(_, it)| !it.is_empty())
        {
            let up = shift[1] + LETTERS * (0.2 - 1.1 * line as f64);
            self.text(at, [shift[0], up], anchor, text);
        }
    }

    /// A text beside a point, shifted by so many of the picture's own units to the right and up.
    pub(super) fn text(&mut self, at: Point, shift: Point, anchor: Anchor, text: &str) {
        let [x, y] = self.at(at);
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let (x, y) = (tenth(x + shift[0]), tenth(y - shift[1]));
        self.body.push(
            html! { text x=(x) y=(y) font-size=(tenth(LETTERS)) text-anchor=(anchor) { (text) } },
        );
    }

    /// Returns the shift up of a label of two lines beside a point (the picture's own units) with which it lies within the
    /// picture, on none of the `lines` and on no label placed before; zero if it would lie on something anywhere. The box of the
    /// label is added to those `placed`.
    pub(super) fn room(
        &self,
        at: Point,
        beside: f64,
        texts: [&str; 2],
        lines: &[[Point; 2]],
        placed: &mut Vec<[Point; 2]>,
    ) -> f64 {
        let longest = texts.iter().map(|text| text.chars().count()).max();
        let width = longest.unwrap_or(0) as f64 * LETTER_WIDTH * LETTERS;
        let [x, y] = self.at(at);
        let left = if beside < 0.0 {
            x + beside - width
        } else {
            x + beside
        };
        let lines: Vec<[Point; 2]> = lines
            .iter()
            .map(|line| line.map(|end| self.at(end)))
            .collect();
        let around = |up: f64| {
            let middle = y - up + 4.0;
            [
                [left, middle - 1.5 * LETTERS],
                [left + width, middle + 1.2 * LETTERS],
            ]
        };
        let is_free = |up: &f64| {
            let place = around(*up);
            place[0][1] >= 0.0
                && place[1][1] <= self.size[1]
                && !lines.iter().any(|line| crosses(*line, place))
                && !placed.iter().any(|it| overlap(*it, place))
        };
        let up = MOVES.into_iter().find(is_free).unwrap_or(0.0);
        placed.push(around(up));
        up
    }

    /// A horizontal dimension, so many of the picture's own units below (negative: above) the lower point.
    pub(super) fn width(&mut self, from: Point, to: Point, below: f64, name: &str) {
        let level = match below >= 0.0 {
            true => from[1].min(to[1]),
            false => from[1].max(to[1]),
        } - self.metres(below);
        self.measure(from, to, [from[0], level], [to[0], level]);
        let middle = [(from[0] + to[0]) / 2.0, level];
        let text = decimals(format!("{name} {:.2} m", (to[0] - from[0]).abs()));
        self.text(middle, [0.0, -LETTERS - 1.0], Anchor::Middle, &text);
    }

    /// A vertical dimension, so many of the picture's own units to the right of the right point.
    pub(super) fn height(&mut self, from: Point, to: Point, beside: f64, name: &str) {
        let level = from[0].max(to[0]) + self.metres(beside);
        self.measure(from, to, [level, from[1]], [level, to[1]]);
        let middle = [level, (from[1] + to[1]) / 2.0];
        let length = decimals(format!("{:.2} m", (to[1] - from[1]).abs()));
        // short lines: there is little room beside a picture
        let lines = name.split_inclusive(' ').map(str::trim_end);
        for (line, text) in lines.chain([length.as_str()]).enumerate() {
            let down = LETTERS * (line as f64 - 1.0);
            self.text(middle, [4.0, -down], Anchor::Start, text);
        }
    }

    fn measure(&mut self, from: Point, to: Point, start: Point, end: Point) {
        self.line("guide", from, start);
        self.line("guide", to, end);
        self.line("dimension", start, end);
        let r = self.metres(1.6);
        self.circle("dimension-end", start, r);
        self.circle("dimension-end", end, r);
    }

    /// With the scale as a bar in the lower left corner: 1 m where it fits. Who does not see it is told what was `found`.
    pub(super) fn finish(mut self, title: &str, found: &str) -> Markup {
        let [width, height] = self.size;
        let metres = [10.0, 1.0, 0.1, 0.01];
        let fits = |metres: &f64| metres * self.scale <= 0.4 * WIDTH;
        let metres = metres.into_iter().find(fits).unwrap_or(0.01);
        let length = metres * self.scale;
        let y = tenth(height - 8.0);
        self.body.push(html! {
            line class="dimension" x1="8" y1=(y) x2=(tenth(8.0 + length)) y2=(y) {}
            text x="8" y=(tenth(height - 12.0)) font-size=(tenth(LETTERS)) text-anchor="start" { (decimals(format!("{metres} m"))) }
        });
        html! {
            figure.drawing {
                svg.top-view viewBox=(format_args!("0 0 {} {}", tenth(width), tenth(height))) role="img" aria-label=(format_args!("{title}. {found}")) {
                    @for part in &self.body { (part) }
                }
                figcaption { (title) }
            }
        }
    }
}

/// Whether a line enters a box, given by two opposite corners.
fn crosses([from, to]: [Point; 2], [low, high]: [Point; 2]) -> bool {
    // the part of the line, 0 to 1, that is within both pairs of sides
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let along = to[axis] - from[axis];
        let [a, b] = [low, high].map(|side| (side[axis] - from[axis]) / along);
        if along == 0.0 {
            if from[axis] < low[axis] || from[axis] > high[axis] {
                return false;
            }
        } else {
            (first, last) = (first.max(a.min(b)), last.min(a.max(b)));
        }
    }
    first <= last
}

/// Whether two boxes have an area in common.
fn overlap([a_low, a_high]: [Point; 2], [b_low, b_high]: [Point; 2]) -> bool {
    (0..2).all(|axis| a_low[axis] < b_high[axis] && b_low[axis] < a_high[axis])
}

fn tenth(value: f64) -> String {
    format!("{:.1}", value + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_axes_have_one_scale() {
        let mut drawing = Drawing::around(&[[0.0, 0.0], [4.0, 1.0]]).unwrap();
        let ([a, b], [c, d]) = (drawing.at([1.0, 0.5]), drawing.at([2.0, 0.5]));
        let [e, f] = drawing.at([1.0, 1.5]);
        assert!((c - a - (b - f)).abs() < 1e-9 && b == d && a == e);
        drawing.width([0.0, 0.0], [4.0, 0.0], 10.0, "wheelbase");
        let text = drawing.finish("side", "").into_string();
        assert!(text.contains("wheelbase 4.00 m") && text.contains("1 m<"));
        assert!(Drawing::around(&[[f64::NAN, 0.0]]).is_none());
    }

    /// A picture as tall as its machine is long was drawn smaller, and its letters with it: they had 2.7 points.
    #[test]
    fn letters_can_be_read_on_the_printed_first_page() {
        let points = 52.0 / 25.4 * 72.0 / WIDTH;
        assert!(LETTERS * points >= 5.2);
        for far in [[1.0, 50.0], [50.0, 1.0], [4.0, 4.0]] {
            let drawing = Drawing::around(&[[0.0, 0.0], far]).unwrap();
            assert!(drawing.size[1] * points < 107.0, "{far:?}");
        }
    }

    #[test]
    fn a_label_makes_room_for_lines_and_other_labels() {
        let drawing = Drawing::around(&[[0.0, 0.0], [4.0, 4.0]]).unwrap();
        let texts = ["FL", "19.6 kN"];
        let mut placed = Vec::new();
        assert_eq!(drawing.room([2.0, 2.0], 8.0, texts, &[], &mut placed), 0.0);
        // where one is already, the next has to move
        assert_ne!(drawing.room([2.0, 2.0], 8.0, texts, &[], &mut placed), 0.0);
        assert!(!overlap(placed[0], placed[1]));
        let arm = [[2.0, 2.0], [4.0, 2.0]];
        let mut placed = Vec::new();
        assert_ne!(
            drawing.room([2.0, 2.0], 8.0, texts, &[arm], &mut placed),
            0.0
        );
        let arm = arm.map(|end| drawing.at(end));
        assert!(!crosses(arm, placed[0]));
    }

    #[test]
    fn a_line_crosses_a_box_or_passes_it() {
        let place = [[0.0, 0.0], [2.0, 1.0]];
        assert!(crosses([[-1.0, -1.0], [3.0, 2.0]], place));
        assert!(crosses([[0.5, 0.5], [0.6, 0.6]], place));
        assert!(crosses([[1.0, -5.0], [1.0, 5.0]], place));
        assert!(!crosses([[-1.0, 0.0], [1.0, 3.0]], place));
        assert!(!crosses([[3.0, -5.0], [3.0, 5.0]], place));
        assert!(!crosses([[-3.0, 0.5], [-1.0, 0.5]], place));
    }
}
