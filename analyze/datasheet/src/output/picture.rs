//! The picture: the machine from the right and from above, with its measures, loads and centre of mass.

use std::fmt::Write;

use nalgebra::Point3;

use super::project::{Outline, View, hull, outlines};
use super::text::escaped;
use crate::body::{Machine, sheet_poses};

/// Width of the picture and its margin (px).
const WIDTH: f64 = 960.0;
const MARGIN: f64 = 46.0;
/// Largest height of the side view (px).
const MOST_HEIGHT: f64 = 440.0;
/// Space between the two views, for the axle loads (px).
const BETWEEN: f64 = 120.0;

/// A plane of the machine on the picture.
struct Frame {
    scale: f64,
    left: f64,
    /// Picture y of the plane's second coordinate at zero (px).
    zero: f64,
}

impl Frame {
    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.left + self.scale * x, self.zero - self.scale * y]
    }
}

/// Smallest and largest coordinates of some outlines.
fn bounds(outlines: &[Outline]) -> [[f64; 2]; 2] {
    let mut found = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for point in outlines.iter().flat_map(|outline| &outline.points) {
        for axis in 0..2 {
            found[axis][0] = found[axis][0].min(point[axis]);
            found[axis][1] = found[axis][1].max(point[axis]);
        }
    }
    found
}

impl Machine {
    /// The picture as SVG (Scalable Vector Graphics), in the posture of the sheet.
    #[must_use]
    pub fn picture(&self) -> String {
        let [side, top] = [View::Side, View::Top].map(|view| outlines(self, view));
        let [side_bounds, top_bounds] = [bounds(&side), bounds(&top)];
        let least = side_bounds[0][0].min(top_bounds[0][0]);
        let most = side_bounds[0][1].max(top_bounds[0][1]);
        let across = (WIDTH - 2.0 * MARGIN) / (most - least).max(0.1);
        let scale = across.min(MOST_HEIGHT / side_bounds[1][1].max(0.1));
        let left = 0.5 * (WIDTH - scale * (least + most));
        let ground = MARGIN + 26.0 + scale * side_bounds[1][1].max(0.1);
        let middle = ground + BETWEEN + scale * top_bounds[1][1];
        let height = middle - scale * top_bounds[1][0] + MARGIN + 30.0;
        let mut out = String::new();
        let _ = writeln!(
            out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height:.0}\" width=\"{WIDTH}\" \
             height=\"{height:.0}\" font-family=\"sans-serif\" font-size=\"13\">\n<title>{name}: side and top view</title>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n\
             <text x=\"{MARGIN}\" y=\"26\" font-size=\"17\" font-weight=\"bold\" fill=\"#1b1d20\">{name}</text>\n\
             <text x=\"{MARGIN}\" y=\"44\" fill=\"#555\">{mass:.0} kg, in the posture of the data sheet; red: centre of mass</text>",
            name = escaped(&self.name),
            mass = self.mass
        );
        let frame = Frame {
            scale,
            left,
            zero: ground,
        };
        let _ = writeln!(
            out,
            "<line x1=\"{MARGIN}\" y1=\"{ground:.1}\" x2=\"{:.1}\" y2=\"{ground:.1}\" stroke=\"#8a8f96\" stroke-width=\"2\"/>",
            WIDTH - MARGIN
        );
        draw(&mut out, &frame, &side, false);
        let [x, y, z] = self.centre_of_mass;
        cross(&mut out, frame.at([x, z]));
        self.loads(&mut out, &frame);
        let above = Frame {
            zero: middle,
            ..frame
        };
        draw(&mut out, &above, &top, true);
        self.polygon(&mut out, &above);
        cross(&mut out, above.at([x, y]));
        out.push_str("</svg>\n");
        out
    }

    /// Axle loads below the ground, with the distances between the axles.
    fn loads(&self, out: &mut String, frame: &Frame) {
        for axle in &self.axles {
            let [x, y] = frame.at([axle.x, 0.0]);
            let _ = writeln!(
                out,
                "<path d=\"M{x:.1} {:.1} V{:.1} m-5 9 l5 -9 l5 9\" fill=\"none\" stroke=\"#1f5fa8\" stroke-width=\"2\"/>",
                y + 34.0,
                y + 5.0
            );
            let text = match (axle.load, axle.is_stated) {
                (Some(load), true) => format!("{load:.0} kg"),
                (Some(load), false) => format!("{load:.0} kg (assumed)"),
                (None, _) => String::new(),
            };
            label(out, [x, y + 49.0], &text, "#1f5fa8");
        }
        let mut places: Vec<f64> = self.axles.iter().map(|axle| axle.x).collect();
        if self.has_tracks {
            let points = self.wheels.iter();
            places = points
                .map(|point| self.place(point.link, point.place).x)
                .collect();
        }
        places.sort_by(f64::total_cmp);
        places.dedup();
        if let (true, [first, .., last]) = (self.has_tracks, &places[..]) {
            places = vec![*first, *last];
        }
        for pair in places.windows(2) {
            let [from, to] = [frame.at([pair[0], 0.0]), frame.at([pair[1], 0.0])];
            dimension(
                out,
                [from[0], from[1] + 64.0],
                [to[0], to[1] + 64.0],
                pair[1] - pair[0],
            );
        }
    }

    /// A point of a link in the posture of the sheet.
    fn place(&self, link: usize, point: [f64; 3]) -> Point3<f64> {
        sheet_poses(&self.links)[link] * Point3::from(point)
    }

    /// The polygon of support, and that of the outriggers.
    fn polygon(&self, out: &mut String, frame: &Frame) {
        let wheels = self
            .wheels
            .iter()
            .map(|wheel| View::Top.of(&self.place(wheel.link, wheel.place)));
        let mut polygons = vec![(
            hull(wheels.collect()),
            "#1f5fa8",
            "support polygon of the wheels",
        )];
        if self.has_tracks {
            polygons[0].2 = "support polygon of the tracks";
        }
        let pads = self
            .outriggers
            .iter()
            .filter_map(|pad| self.link(&pad.link));
        let pads: Vec<[f64; 2]> = pads
            .map(|link| View::Top.of(&self.place(link, [0.0; 3])))
            .collect();
        if !pads.is_empty() {
            polygons.push((hull(pads), "#b3261e", "outriggers"));
        }
        let mut at = MARGIN;
        let bottom = self.bottom(frame);
        for (polygon, colour, name) in polygons {
            let points = polygon.iter().map(|p| frame.at(*p));
            let points: Vec<String> = points.map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            let _ = writeln!(
                out,
                "<polygon points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\" stroke-dasharray=\"7 4\"/>",
                points.join(" ")
            );
            let _ = writeln!(
                out,
                "<line x1=\"{at:.1}\" y1=\"{bottom:.1}\" x2=\"{:.1}\" y2=\"{bottom:.1}\" stroke=\"{colour}\" stroke-width=\"1.6\" \
                 stroke-dasharray=\"7 4\"/><text x=\"{:.1}\" y=\"{:.1}\" fill=\"#333\">{name}</text>",
                at + 34.0,
                at + 42.0,
                bottom + 4.5
            );
            at += 260.0;
        }
    }

    fn bottom(&self, frame: &Frame) -> f64 {
        let top = outlines(self, View::Top);
        frame.zero - frame.scale * bounds(&top)[1][0] + 32.0
    }
}

fn draw(out: &mut String, frame: &Frame, outlines: &[Outline], is_top: bool) {
    for outline in outlines {
        let points = outline.points.iter().map(|p| frame.at(*p));
        let points: Vec<String> = points.map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let [r, g, b] = outline.colour.map(|c| (c * 255.0).round());
        let opacity = if outline.is_support && !is_top {
            0.45
        } else {
            0.88
        };
        let _ = writeln!(
            out,
            "<polygon points=\"{}\" fill=\"rgb({r:.0},{g:.0},{b:.0})\" fill-opacity=\"{opacity}\" stroke=\"#1b1d20\" \
             stroke-width=\"0.8\"/>",
            points.join(" ")
        );
    }
}

/// The centre of mass.
fn cross(out: &mut String, [x, y]: [f64; 2]) {
    let _ = writeln!(
        out,
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"7\" fill=\"#ffffff\" stroke=\"#d01010\" stroke-width=\"2.4\"/><path d=\"M{:.1} {y:.1} h14 M{x:.1} \
         {:.1} v14\" stroke=\"#d01010\" stroke-width=\"2\"/>",
        x - 7.0,
        y - 7.0
    );
}

fn label(out: &mut String, [x, y]: [f64; 2], text: &str, colour: &str) {
    let _ = writeln!(
        out,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\" fill=\"{colour}\">{}</text>",
        escaped(text)
    );
}

/// A measure between two points on one height.
fn dimension(out: &mut String, from: [f64; 2], to: [f64; 2], length: f64) {
    let y = from[1];
    let _ = writeln!(
        out,
        "<path d=\"M{:.1} {y:.1} H{:.1} M{:.1} {:.1} v10 M{:.1} {:.1} v10\" fill=\"none\" stroke=\"#555\"/>",
        from[0],
        to[0],
        from[0],
        y - 5.0,
        to[0],
        y - 5.0
    );
    label(
        out,
        [0.5 * (from[0] + to[0]), y + 16.0],
        &format!("{length:.2} m"),
        "#333",
    );
}
