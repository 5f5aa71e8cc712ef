//! Pictures: the few SVG elements that the report draws, in the style of their classes.

use krilla::geom::{Path, PathBuilder};
use roxmltree::Node;

use super::flow::{Flow, LEADING, Mark};

const CAPTION: f32 = 8.0;
/// Room between pictures side by side (points).
const BETWEEN: f32 = 10.0;
/// Largest height of a picture (points).
const TALLEST: f32 = 330.0;
const TALLEST_OF_SMALL: f32 = 105.0;
/// Least size of letters in a picture, however small it is drawn (points).
const LEAST_LETTERS: f32 = 5.2;
/// Control points of a quarter circle.
const QUARTER: f32 = 0.552_284_8;

/// Style of the elements of a class: fill with opacity; stroke with width and dashes.
struct Style {
    fill: Option<([u8; 3], f32)>,
    stroke: Option<([u8; 3], f32, bool)>,
}

fn style(class: &str) -> Style {
    let (fill, stroke) = match class {
        "support" => (
            Some(([244, 244, 244], 1.0)),
            Some(([51, 51, 51], 1.2, false)),
        ),
        "tyre" => (
            Some(([217, 217, 217], 1.0)),
            Some(([119, 119, 119], 0.8, false)),
        ),
        "load" => (
            Some(([0, 114, 178], 0.55)),
            Some(([0, 75, 118], 0.8, false)),
        ),
        "load light" => (
            Some(([230, 159, 0], 0.55)),
            Some(([138, 95, 0], 0.8, false)),
        ),
        "at-rest" => (None, Some(([51, 51, 51], 0.8, true))),
        "axle" => (None, Some(([119, 119, 119], 3.0, false))),
        "lifted" => (None, Some(([179, 25, 10], 2.5, false))),
        "arm" => (None, Some(([110, 110, 110], 4.0, false))),
        "zmp" => (
            Some(([204, 79, 0], 1.0)),
            Some(([255, 255, 255], 0.6, false)),
        ),
        "com" => (None, Some(([0, 0, 0], 1.0, false))),
        "gravity" => (None, Some(([51, 51, 51], 1.6, false))),
        "ground" => (None, Some(([120, 90, 60], 1.6, false))),
        "guide" => (None, Some(([150, 150, 150], 0.6, true))),
        "dimension" | "axis" => (None, Some(([80, 80, 80], 0.8, false))),
        "dimension-end" => (Some(([80, 80, 80], 1.0)), None),
        "used-low" => (None, Some(([0, 114, 178], 3.0, false))),
        "used-notice" => (None, Some(([230, 159, 0], 3.0, false))),
        "used-warning" => (None, Some(([213, 94, 0], 3.0, false))),
        "used-limit" => (None, Some(([150, 0, 0], 3.0, false))),
        "used-unknown" => (None, Some(([170, 170, 170], 3.0, false))),
        "envelope" => (Some(([150, 150, 150], 0.35)), None),
        "band" => (Some(([0, 114, 178], 0.35)), None),
        "limit" => (None, Some(([170, 0, 0], 0.9, true))),
        "line-b" => (None, Some(([0, 114, 178], 1.2, true))),
        "line-c" => (None, Some(([213, 94, 0], 1.2, false))),
        "line-d" => (None, Some(([0, 158, 115], 1.2, true))),
        "event" => (None, Some(([160, 0, 0], 0.8, true))),
        "step-steady" => (Some(([0, 158, 115], 1.0)), None),
        "step-known" => (Some(([0, 114, 178], 1.0)), None),
        "step-light" => (Some(([230, 159, 0], 1.0)), None),
        "step-lift" => (Some(([213, 94, 0], 1.0)), None),
        "step-tip" => (Some(([150, 0, 0], 1.0)), None),
        "step-gap" => (Some(([150, 150, 150], 1.0)), None),
        "step-band" => (None, Some(([26, 26, 26], 1.2, false))),
        _ => (None, Some(([26, 26, 26], 1.0, false))),
    };
    Style { fill, stroke }
}

/// Distance of the lines of a label as a share of their letters, at least.
const BELOW: f32 = 0.95;

/// A text that was drawn: where it is anchored, and its baseline as stated and as drawn (points).
struct Label<'a> {
    x: f32,
    anchor: Option<&'a str>,
    stated_y: f32,
    y: f32,
}

/// Place and size of a picture.
#[derive(Clone, Copy)]
struct Frame {
    left: f32,
    top: f32,
    scale: f32,
}

impl Frame {
    fn at(self, x: f32, y: f32) -> [f32; 2] {
        [self.left + x * self.scale, self.top + y * self.scale]
    }
}

/// Draws pictures side by side, with their captions below; small ones where much must stand on a page.
pub(super) fn add(flow: &mut Flow<'_>, pictures: &[(Node<'_, '_>, String)], small: bool) {
    let tallest = match small {
        true => TALLEST_OF_SMALL,
        false => flow.scale * TALLEST,
    };
    let (width, letters) = (flow.width, CAPTION * flow.scale);
    // a wide picture alone takes the whole width
    let least = match pictures {
        [(svg, _)] if size(*svg, width, TALLEST).0 < 1.0 => 1,
        _ => 2,
    };
    let places = pictures.len().max(least) as f32;
    let rooms = rooms(pictures, width - (places - 1.0) * BETWEEN, places, tallest);
    let sizes: Vec<(f32, f32, f32)> = (pictures.iter().zip(&rooms))
        .map(|((svg, _), &room)| size(*svg, room, tallest))
        .collect();
    let highest = sizes.iter().map(|size| size.2).fold(0.0, f32::max);
    let captions: Vec<Vec<String>> = (pictures.iter().zip(&rooms))
        .map(|((_, caption), &room)| flow.letters.lines(caption, letters, room))
        .collect();
    let lines = captions.iter().map(Vec::len).max().unwrap_or(0);
    let below = lines as f32 * letters * LEADING;
    flow.room(highest + below + 8.0);
    let top = flow.y;
    for (place, ((svg, _), (scale, _, _))) in pictures.iter().zip(&sizes).enumerate() {
        let before: f32 = rooms[..place].iter().sum();
        let left = before + place as f32 * BETWEEN;
        let frame = Frame {
            left: flow.left() + left,
            top,
            scale: *scale,
        };
        let mut above = None;
        for element in svg.descendants().filter(Node::is_element) {
            draw(flow, element, frame, &mut above);
        }
        for (line, text) in captions[place].iter().enumerate() {
            let y = top + highest + (line as f32 + 1.0) * letters * LEADING;
            flow.text([left, y], letters, false, text);
        }
    }
    flow.y = top + highest + below + 10.0 * flow.scale;
}

/// The room of each picture in a width: what the height does not let one use, the others have, in equal shares.
fn rooms(pictures: &[(Node<'_, '_>, String)], width: f32, places: f32, tallest: f32) -> Vec<f32> {
    let used = |svg: &Node<'_, '_>, room: f32| size(*svg, room, tallest).1;
    let mut rooms = vec![width / places; pictures.len()];
    let mut free: Vec<usize> = (0..pictures.len()).collect();
    let mut left = rooms.iter().sum::<f32>();
    loop {
        let share = left / free.len().max(1) as f32;
        let is_low = |place: &usize| used(&pictures[*place].0, share) < share - 0.5;
        let Some(at) = free.iter().position(is_low) else {
            free.iter().for_each(|&place| rooms[place] = share);
            return rooms;
        };
        let place = free.remove(at);
        rooms[place] = used(&pictures[place].0, share);
        left -= rooms[place];
    }
}

/// Scale, width and height of a picture in so much room.
fn size(svg: Node<'_, '_>, room: f32, tallest: f32) -> (f32, f32, f32) {
    let view = svg.attribute("viewBox").unwrap_or_default();
    let numbers: Vec<f32> = view
        .split_whitespace()
        .filter_map(|n| n.parse().ok())
        .collect();
    let (width, height) = match numbers[..] {
        [_, _, width, height] if width > 0.0 && height > 0.0 => (width, height),
        _ => (100.0, 1.0),
    };
    let scale = (room / width).min(tallest / height);
    (scale, width * scale, height * scale)
}

fn draw<'a>(
    flow: &mut Flow<'_>,
    element: Node<'a, '_>,
    frame: Frame,
    above: &mut Option<Label<'a>>,
) {
    let zero = |name: &str| number(element, name).unwrap_or(0.0);
    let style = style(element.attribute("class").unwrap_or_default());
    let path = match element.tag_name().name() {
        "line" => polygon(
            &[
                frame.at(zero("x1"), zero("y1")),
                frame.at(zero("x2"), zero("y2")),
            ],
            false,
        ),
        "rect" => {
            let (x, y, width, height) = (zero("x"), zero("y"), zero("width"), zero("height"));
            let corners = [
                [x, y],
                [x + width, y],
                [x + width, y + height],
                [x, y + height],
            ];
            polygon(&corners.map(|[x, y]| frame.at(x, y)), true)
        }
        name @ ("polygon" | "polyline") => {
            let points = element.attribute("points").unwrap_or_default();
            let pair = |text: &str| {
                let (x, y) = text.split_once(',')?;
                Some(frame.at(x.parse().ok()?, y.parse().ok()?))
            };
            let points: Vec<[f32; 2]> = points.split_whitespace().filter_map(pair).collect();
            polygon(&points, name == "polygon")
        }
        "circle" => circle(frame.at(zero("cx"), zero("cy")), zero("r") * frame.scale),
        "text" => return text(flow, element, frame, above),
        _ => None,
    };
    let Some(path) = path else {
        return;
    };
    // an open line has no area
    let is_open = matches!(element.tag_name().name(), "line" | "polyline");
    let stroke = style
        .stroke
        .map(|(colour, width, dashed)| (colour, width * frame.scale.min(1.0), dashed));
    flow.mark(Mark::Path {
        path,
        fill: style.fill.filter(|_| !is_open),
        stroke,
    });
}

/// A number that an element states.
fn number(element: Node<'_, '_>, name: &str) -> Option<f32> {
    element.attribute(name)?.parse().ok()
}

fn polygon(points: &[[f32; 2]], closed: bool) -> Option<Path> {
    let (first, rest) = points.split_first()?;
    let mut builder = PathBuilder::new();
    builder.move_to(first[0], first[1]);
    rest.iter()
        .for_each(|point| builder.line_to(point[0], point[1]));
    if closed {
        builder.close();
    }
    builder.finish()
}

fn circle([x, y]: [f32; 2], r: f32) -> Option<Path> {
    let k = QUARTER * r;
    let mut builder = PathBuilder::new();
    builder.move_to(x + r, y);
    builder.cubic_to(x + r, y + k, x + k, y + r, x, y + r);
    builder.cubic_to(x - k, y + r, x - r, y + k, x - r, y);
    builder.cubic_to(x - r, y - k, x - k, y - r, x, y - r);
    builder.cubic_to(x + k, y - r, x + r, y - k, x + r, y);
    builder.close();
    builder.finish()
}

/// Draws a text. Where letters are larger than those of the picture, the lines of a label are moved apart.
fn text<'a>(
    flow: &mut Flow<'_>,
    element: Node<'a, '_>,
    frame: Frame,
    above: &mut Option<Label<'a>>,
) {
    let zero = |name: &str| number(element, name).unwrap_or(0.0);
    let size = (number(element, "font-size").unwrap_or(11.0) * frame.scale).max(LEAST_LETTERS);
    let words = flow.letters.known(element.text().unwrap_or_default());
    let width = flow.letters.width(&words, size);
    let anchor = element.attribute("text-anchor");
    let shift = match anchor {
        Some("middle") => width / 2.0,
        Some("end") => width,
        _ => 0.0,
    };
    let [x, stated_y] = frame.at(zero("x"), zero("y"));
    let is_below =
        |it: &&Label<'_>| it.anchor == anchor && (it.x - x).abs() < 0.1 && stated_y > it.stated_y;
    let least_y = (above.as_ref().filter(is_below)).map(|it| it.y + BELOW * size);
    let y = least_y.map_or(stated_y, |least_y| stated_y.max(least_y));
    *above = Some(Label {
        x,
        anchor,
        stated_y,
        y,
    });
    flow.text([x - shift - flow.left(), y], size, false, &words);
}
