//! Small charts as SVG.

use maud::{Markup, html};
use tipwatch_language::{decimals, say};

use crate::base::number::number;

/// The style of charts.
pub(crate) const CHART_STYLE: &str = include_str!("svg.css");
/// Size of a chart and its borders, in its own units, with letters of 11.
const SIZE: [f64; 2] = [340.0, 170.0];
/// Size of one of four beside each other on the printed first page: its letters have 5.2 points or more there.
const QUARTER: [f64; 2] = [260.0, 138.0];
const LEFT: f64 = 44.0;
const RIGHT: f64 = 8.0;
const TOP: f64 = 8.0;
const BOTTOM: f64 = 34.0;
/// A point this far from a line, a third of its width, is seen beside it.
const SEEN: f64 = 0.4;
/// Height of a name of a line.
const NAME_HEIGHT: f64 = 11.0;
/// Width of a letter of a name, and of the sample of the line before it.
const LETTER_WIDTH: f64 = 6.2;
const SAMPLE_WIDTH: f64 = 12.0;

/// A chart with axes; numbers outside its ranges are drawn at its edge.
pub(crate) struct Chart {
    x: (f64, f64),
    y: (f64, f64),
    size: [f64; 2],
    /// The right end of the drawing area, and its floor.
    end: f64,
    floor: f64,
    body: Vec<Markup>,
    title: String,
    /// Description of the chart in words, for readers who do not see it.
    told: Vec<String>,
}

impl Chart {
    pub(crate) fn new(title: &str, x: (f64, f64), y: (f64, f64)) -> Self {
        Self::sized(SIZE, title, x, y)
    }

    /// One of four charts beside each other on paper.
    pub(crate) fn quarter(title: &str, x: (f64, f64), y: (f64, f64)) -> Self {
        Self::sized(QUARTER, title, x, y)
    }

    fn sized(size: [f64; 2], title: &str, x: (f64, f64), y: (f64, f64)) -> Self {
        Self {
            x,
            y,
            size,
            end: size[0] - RIGHT,
            floor: size[1] - BOTTOM,
            body: Vec::new(),
            title: title.into(),
            told: Vec::new(),
        }
    }

    /// Leaves room beside the drawing area for the names of lines, which lie on none then. To be called before anything is drawn.
    pub(crate) fn with_names<'n>(mut self, names: impl Iterator<Item = &'n str>) -> Self {
        let longest = names.map(|name| name.chars().count()).max().unwrap_or(0);
        // a very long name is cut by the frame, and leaves the lines a half
        let end = self.end - LETTER_WIDTH * longest as f64 - SAMPLE_WIDTH - 2.0;
        self.end = end.max(0.5 * self.size[0]);
        self
    }

    fn at_x(&self, x: f64) -> f64 {
        let share = ((x - self.x.0) / (self.x.1 - self.x.0)).clamp(0.0, 1.0);
        LEFT + share * (self.end - LEFT)
    }

    fn at_y(&self, y: f64) -> f64 {
        let share = ((y - self.y.0) / (self.y.1 - self.y.0)).clamp(0.0, 1.0);
        self.floor - share * (self.floor - TOP)
    }

    /// A bar, with a text that a pointer shows.
    pub(crate) fn bar(&mut self, from: f64, to: f64, height: f64, class: &str, text: &str) {
        let (left, right, top) = (self.at_x(from), self.at_x(to), self.at_y(height));
        let width = (right - left - 1.0).max(0.5);
        self.told.push(text.into());
        self.body.push(html! {
            rect class=(class) x=(tenth(left)) y=(tenth(top)) width=(tenth(width)) height=(tenth(self.floor - top)) {
                title { (text) }
            }
        });
    }

    /// A named line through values over time (s), whose course is told, too.
    pub(crate) fn curve(&mut self, name: &str, points: &[(f64, f64)], class: &str) {
        self.line(points, class);
        self.told.push(course(name, points));
    }

    /// A line through points; one that is not finite breaks it.
    pub(crate) fn line(&mut self, points: &[(f64, f64)], class: &str) {
        let is_broken = |(x, y): &(f64, f64)| !(x.is_finite() && y.is_finite());
        for run in points.split(is_broken).filter(|run| !run.is_empty()) {
            let points = run.iter().map(|&(x, y)| [self.at_x(x), self.at_y(y)]);
            let points = written(&simplified(&points.collect::<Vec<_>>()));
            self.body
                .push(html! { polyline class=(class) points=(points) {} });
        }
    }

    /// The area between two curves over the same places; one that is not finite breaks it.
    pub(crate) fn area(&mut self, points: &[(f64, f64, f64)], class: &str) {
        let is_broken = |(x, low, high): &(f64, f64, f64)| !(x + low + high).is_finite();
        for run in points.split(is_broken).filter(|run| !run.is_empty()) {
            let at = |x: f64, y: f64| [self.at_x(x), self.at_y(y)];
            let there: Vec<_> = run.iter().map(|&(x, _, high)| at(x, high)).collect();
            let back: Vec<_> = run.iter().rev().map(|&(x, low, _)| at(x, low)).collect();
            let corners = written(&[simplified(&there), simplified(&back)].concat());
            self.body
                .push(html! { polygon class=(class) points=(corners) {} });
        }
    }

    /// A dashed horizontal line at a value.
    pub(crate) fn guide(&mut self, y: f64) {
        let y = self.at_y(y);
        self.segment("guide", [LEFT, y], [self.end, y]);
    }

    /// A dashed vertical line at a value.
    pub(crate) fn guide_up(&mut self, x: f64) {
        let x = self.at_x(x);
        self.segment("guide", [x, TOP], [x, self.floor]);
    }

    /// A dashed vertical line of a class at a value.
    pub(crate) fn mark_up(&mut self, x: f64, class: &str) {
        let x = self.at_x(x);
        self.segment(class, [x, TOP], [x, self.floor]);
    }

    /// Names of lines beside their right ends, with their values there: one above the other where they are close. The chart has
    /// room [`with_names`](Self::with_names).
    pub(crate) fn names(&mut self, mut names: Vec<(f64, &str, &str)>) {
        names.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut free = TOP + 8.0;
        let below = NAME_HEIGHT * names.len() as f64;
        for (place, (value, name, class)) in names.into_iter().enumerate() {
            // those that follow need room, too
            let lowest = self.floor - below + NAME_HEIGHT * (place as f64 + 1.0) - 2.0;
            let y = (self.at_y(value) - 3.0).min(lowest).max(free);
            free = y + NAME_HEIGHT;
            let sample = self.end + 2.0;
            self.segment(
                class,
                [sample, y - 3.5],
                [sample + SAMPLE_WIDTH - 3.0, y - 3.5],
            );
            self.text([sample + SAMPLE_WIDTH, y], "start", name);
        }
    }

    fn segment(&mut self, class: &str, from: [f64; 2], to: [f64; 2]) {
        self.body.push(segment(class, from, to));
    }

    pub(crate) fn label_x(&mut self, x: f64, text: &str) {
        let x = self.at_x(x);
        let anchor = match x {
            x if x < LEFT + 20.0 => "start",
            x if x > self.end - 20.0 => "end",
            _ => "middle",
        };
        self.text([x, self.floor + 14.0], anchor, &decimals(text));
    }

    pub(crate) fn label_y(&mut self, y: f64, text: &str) {
        self.text([LEFT - 4.0, self.at_y(y) + 4.0], "end", &decimals(text));
    }

    /// The name of the horizontal axis.
    pub(crate) fn caption_x(&mut self, text: &str) {
        let place = [(LEFT + self.end) / 2.0, self.size[1] - 5.0];
        self.text(place, "middle", text);
    }

    fn text(&mut self, [x, y]: [f64; 2], anchor: &str, text: &str) {
        let text = html! { text x=(tenth(x)) y=(tenth(y)) text-anchor=(anchor) { (text) } };
        self.body.push(text);
    }

    pub(crate) fn finish(self) -> Markup {
        let (floor, [width, height]) = (self.floor, self.size);
        html! {
            figure {
                figcaption { (self.title) }
                svg.chart viewBox=(format_args!("0 0 {width} {height}")) role="img" aria-label=(format_args!("{}: {}", self.title, self.told.join("; "))) {
                    @for part in &self.body { (part) }
                    (segment("axis", [LEFT, floor], [self.end, floor]))
                    (segment("axis", [LEFT, TOP], [LEFT, floor]))
                }
            }
        }
    }
}

/// Ends and extremes of values over time (s), in words.
pub(crate) fn course(name: &str, points: &[(f64, f64)]) -> String {
    let known = || points.iter().filter(|(_, value)| value.is_finite());
    let (Some(first), Some(last)) = (known().next(), known().next_back()) else {
        return say!("{name} unknown");
    };
    let least = known().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(first);
    let greatest = known().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(first);
    let [first, last, least, greatest] =
        [first, last, least, greatest].map(|(time_s, value)| (number(*value), time_s));
    say!(
        "{name} from {} at {:.1} s to {} at {:.1} s, least {} at {:.1} s, greatest {} at {:.1} s",
        first.0,
        first.1,
        last.0,
        last.1,
        least.0,
        least.1,
        greatest.0,
        greatest.1
    )
}

/// The points of a line that differs from the given one by less than can be seen, ends and peaks included (Ramer, Douglas and
/// Peucker).
fn simplified(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let Some(last) = points.len().checked_sub(1).filter(|last| *last > 0) else {
        return points.to_vec();
    };
    let mut kept = vec![false; points.len()];
    (kept[0], kept[last]) = (true, true);
    let mut spans = vec![(0, last)];
    while let Some((from, to)) = spans.pop() {
        let ([ax, ay], [bx, by]) = (points[from], points[to]);
        let length = (bx - ax).hypot(by - ay);
        let off = |[x, y]: [f64; 2]| match length > 0.0 {
            true => ((bx - ax) * (ay - y) - (ax - x) * (by - ay)).abs() / length,
            false => (x - ax).hypot(y - ay),
        };
        let between = (from + 1..to).map(|k| (k, off(points[k])));
        let farthest = between.max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((k, _)) = farthest.filter(|(_, off)| *off > SEEN) {
            kept[k] = true;
            spans.extend([(from, k), (k, to)]);
        }
    }
    let points = points.iter().zip(kept);
    points
        .filter(|(_, kept)| *kept)
        .map(|(point, _)| *point)
        .collect()
}

fn written(points: &[[f64; 2]]) -> String {
    let points = points
        .iter()
        .map(|[x, y]| format!("{},{}", tenth(*x), tenth(*y)));
    points.collect::<Vec<_>>().join(" ")
}

/// A coordinate, to a tenth of a unit.
fn tenth(value: f64) -> String {
    format!("{value:.1}")
}

fn segment(class: &str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) -> Markup {
    html! { line class=(class) x1=(tenth(x1)) y1=(tenth(y1)) x2=(tenth(x2)) y2=(tenth(y2)) {} }
}

/// The next number of the series 1, 1.5, 2, 3, 4, 5, 6, 8, 10, 15, ... for the end of an axis: a curve takes at least two thirds of it.
pub(crate) fn round_up(value: f64) -> f64 {
    if !(value > 0.0) {
        return 1.0;
    }
    let exponent = value.log10().floor() as i32;
    // a negative power of ten is not exact, and neither is a product with it: 3 * 0.1 is 0.30000000000000004
    let power = 10f64.powi(exponent.abs());
    let scaled = |step: f64| {
        if exponent < 0 {
            step / power
        } else {
            step * power
        }
    };
    let steps = [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0].map(scaled);
    steps
        .into_iter()
        .find(|&step| step >= value)
        .unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_of_axes_are_short_numbers() {
        for exponent in -4..5 {
            for step in [1.2, 2.4, 2.7, 5.5, 7.1] {
                let end = round_up(step * 10f64.powi(exponent));
                assert!(format!("{end}").len() <= 7, "{end}");
            }
        }
        assert_eq!(round_up(0.27), 0.3);
    }

    #[test]
    fn a_line_keeps_its_peaks_and_loses_what_nobody_sees() {
        let points: Vec<[f64; 2]> = (0..300)
            .map(|k| {
                [
                    f64::from(k),
                    if k == 77 { 9.0 } else { 0.1 * f64::from(k % 2) },
                ]
            })
            .collect();
        let simple = simplified(&points);
        assert!(simple.len() < 8, "{simple:?}");
        assert!(simple.contains(&points[77]) && simple.contains(&points[299]));
        let off = |[x, y]: [f64; 2]| {
            let after = simple.partition_point(|point| point[0] < x).max(1);
            let ([ax, ay], [bx, by]) = (simple[after - 1], simple[after]);
            (ay + (x - ax) / (bx - ax) * (by - ay) - y).abs()
        };
        // nearly upright lines are far off at one place and close beside it
        assert!(
            points
                .iter()
                .filter(|point| off(**point) > 2.0 * SEEN)
                .count()
                < 3
        );
        assert_eq!(simplified(&points[..1]), &points[..1]);
        assert!(simplified(&[]).is_empty());
    }
}
