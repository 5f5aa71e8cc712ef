//! The machine at one row: from above, and from the right or from behind, to scale, with its loads and their bands.

use maud::{Markup, html};
use nalgebra::{Vector2, Vector3};
use tipwatch_language::{decimals, say, word};
use tipwatch_mechanics::machine::{SupportKind, Wheel};
use tipwatch_mechanics::{Placement, Quantity, State};

use super::area::Area;
use super::drawing::{Anchor, Drawing, Point};
use crate::analysis::Analysis;
use crate::base::rows::Rows;
use crate::events::support_words::SupportWord;
use crate::events::{Event, EventKind};
use crate::page::{number, table_of};

/// Radius of the disc of the largest load at rest, as a share of the smaller distance between wheels.
const LARGEST_DISC: f64 = 0.24;
/// Width of a drawn tyre as a share of its diameter.
const TYRE_WIDTH: f64 = 0.35;
/// A label that is moved farther up or down than this, in the picture's own units, has a line to its wheel.
const FAR: f64 = 12.0;
/// Least half of a cross, in the picture's own units: a foot has no radius.
const LEAST_CROSS: f64 = 7.0;

/// The machine at a row, from above and across, with its loads; without them where they are `contradicted` by what happened.
/// The second picture is in the plane in which the machine turned about the edge of the `event`, else in that in which gravity
/// leans more. `None` where no picture can be drawn, as the row does not say where the machine's parts are.
pub(super) fn pictures(
    analysis: &Analysis,
    row: usize,
    event: Option<&Event>,
    contradicted: bool,
) -> Option<Markup> {
    let mut state = State::zero(&analysis.machine);
    let found = analysis.rows.window(row..row + 1);
    found.states.get(0, &mut state);
    let mut placement = Placement::new(&analysis.machine);
    placement.place(&state);
    let known: Vec<bool> = (0..analysis.machine.wheels().len())
        .map(|wheel| found.value(Quantity::Load(wheel), 0).is_finite())
        .collect();
    let mut view = View {
        down: Vector3::repeat(f64::NAN),
        across: Across::Length,
        area: Area::of(&analysis.rows, row, &state),
        // all of them where none is known
        carries: match known.contains(&true) {
            true => known,
            false => vec![true; known.len()],
        },
        off: off_ground(analysis, row),
        tips: tips(analysis, row),
        analysis,
        placement: &placement,
        rows: &found,
        contradicted,
    };
    let on_plane = placement.on_plane(&-state.base.up);
    view.down = Vector3::new(
        on_plane.x,
        on_plane.y,
        -placement.normal.dot(&state.base.up),
    );
    let edge = event.and_then(|event| analysis.machine.edge_named(&event.subject));
    let turns = edge.map(|edge| placement.tipping_line(edge).through);
    let turns = turns.map(|[from, to]| placement.on_plane(&(to - from)));
    // about a line along the machine it turns to its side
    let [along, aside] = match turns {
        Some(line) => [line.y.abs(), line.x.abs()],
        None => [view.down.x.abs(), view.down.y.abs()],
    };
    if aside > along {
        view.across = Across::Width;
    }
    let drawn = [view.view_from_above(), view.view_across()];
    let drawn: Vec<Markup> = drawn.into_iter().flatten().collect();
    (!drawn.is_empty()).then(|| {
        html! {
            div.pictures.two { @for picture in &drawn { (picture) } }
        }
    })
}

/// The loads at a row, with their bands and the range over all splits.
pub(super) fn loads(analysis: &Analysis, row: usize) -> Markup {
    let machine = &analysis.machine;
    let found = analysis.rows.window(row..row + 1);
    let value = |quantity| found.value(quantity, 0);
    let has_sigma = analysis.rows.has(Quantity::LoadSigma(0));
    let cells = machine.wheels().iter().enumerate().map(|(wheel, facts)| {
        let sigma = match has_sigma {
            true => number(2.0 * value(Quantity::LoadSigma(wheel))),
            false => word!("not computed").into(),
        };
        let (least, largest) = (
            value(Quantity::LoadLeast(wheel)),
            value(Quantity::LoadLargest(wheel)),
        );
        let any_split = match (least + largest).is_finite() {
            true => say!("{} to {}", number(least), number(largest)),
            false => word!("not computable").into(),
        };
        let at_rest = machine.reference().static_load[wheel];
        [
            (SupportWord::of(machine).head, facts.name.clone()),
            (
                word!("Load, stated split [N]"),
                number(value(Quantity::Load(wheel))),
            ),
            ("± 2 σ [N]", sigma),
            (word!("Load, any split [N]"), any_split),
            (word!("OTF [N]"), number(value(Quantity::Otf(wheel)))),
            (word!("At rest [N]"), number(at_rest)),
        ]
    });
    table_of(cells)
}

/// Direction of a picture that is not from above.
#[derive(Clone, Copy, PartialEq)]
enum Across {
    /// From the right.
    Length,
    /// From behind.
    Width,
}

/// The machine at one row.
struct View<'a> {
    across: Across,
    /// Gravity's direction: forward, left and along the normal of the contact plane; NaN where it is unknown.
    down: Vector3<f64>,
    area: Area,
    analysis: &'a Analysis,
    placement: &'a Placement<'a>,
    /// The row alone.
    rows: &'a Rows,
    /// The wheels and feet that the machine stands on or would stand on: those with loads.
    carries: Vec<bool>,
    /// The wheels and feet that are off the ground by the events, whatever is left of their load within its error.
    off: Vec<bool>,
    /// Whether the machine tips by the events: then the zero moment point is on the line about which the machine tips, within its
    /// error.
    tips: bool,
    /// Whether the loads of the row are not those of the machine that stood there.
    contradicted: bool,
}

impl View<'_> {
    /// Forward is up.
    fn above(&self, point: &Vector3<f64>) -> Point {
        let on_plane = self.placement.on_plane(point);
        [-on_plane.y, on_plane.x]
    }

    /// Of forward and left, what is to the right.
    fn right(&self, forward: f64, left: f64) -> f64 {
        match self.across {
            Across::Length => forward,
            Across::Width => -left,
        }
    }

    fn side(&self, point: &Vector3<f64>) -> Point {
        let ground: Vec<f64> = self
            .standing(&self.placement.contacts)
            .map(|contact| self.placement.normal.dot(contact))
            .collect();
        let ground = ground.iter().sum::<f64>() / ground.len() as f64;
        let on_plane = self.placement.on_plane(point);
        let right = self.right(on_plane.x, on_plane.y);
        [right, self.placement.normal.dot(point) - ground]
    }

    /// Of values by support, those of the supports that the machine stands on.
    fn standing<'b, T>(&'b self, all: &'b [T]) -> impl Iterator<Item = &'b T> {
        let all = all.iter().zip(&self.carries);
        all.filter(|(_, carries)| **carries).map(|(one, _)| one)
    }

    /// Whether the machine stands on wheels alone, so that their distances are its wheelbase and track.
    fn is_on_wheels(&self) -> bool {
        let mut standing = self.standing(self.analysis.machine.wheels());
        standing.all(|wheel| wheel.kind == SupportKind::Wheel)
    }

    /// Returns the load of a wheel (N): zero where it is off the ground, whatever is left of its load within its error.
    fn load(&self, wheel: usize) -> f64 {
        match self.rows.value(Quantity::Load(wheel), 0) {
            load if load.is_finite() && self.off[wheel] => 0.0,
            load => load,
        }
    }

    fn zmp(&self) -> Option<Point> {
        let value = |quantity| self.rows.value(quantity, 0);
        let (x, y) = (value(Quantity::ZmpX), value(Quantity::ZmpY));
        (!self.contradicted && x.is_finite() && y.is_finite()).then_some([-y, x])
    }

    fn view_from_above(&self) -> Option<Markup> {
        let machine = &self.analysis.machine;
        let contacts: Vec<Point> = self
            .placement
            .contacts
            .iter()
            .map(|c| self.above(c))
            .collect();
        let radius = machine
            .wheels()
            .iter()
            .map(|wheel| wheel.radius)
            .fold(0.0, f64::max);
        let largest_disc_m = LARGEST_DISC * smaller_span(&contacts);
        let below = radius.max(largest_disc_m);
        let around = |&[x, y]: &Point| {
            [
                [x - 0.4 * radius, y - below],
                [x + 0.4 * radius, y + radius],
            ]
        };
        let mut all: Vec<Point> = contacts.iter().flat_map(around).collect();
        // names and loads stand beside the wheels
        let across = || contacts.iter().map(|contact| contact[0]);
        let (low, high) = (
            across().fold(f64::INFINITY, f64::min),
            across().fold(f64::NEG_INFINITY, f64::max),
        );
        let beside = 0.45 * (high - low);
        all.extend(
            contacts
                .iter()
                .flat_map(|&[x, y]| [[x - beside, y], [x + beside, y]]),
        );
        let arm: Vec<[Point; 2]> = self.arm(Self::above);
        all.extend(arm.iter().flatten());
        let mut drawing = Drawing::around(&all)?;
        let carries = &self.carries;
        let seen = |at: &Vector2<f64>| [-at.y, at.x];
        let corners: Vec<Point> = self.area.corners.iter().map(seen).collect();
        drawing.polygon("support", &corners);
        for [from, to] in &self.area.axles {
            drawing.line("axle", seen(from), seen(to));
        }
        let at_rest = &machine.reference().static_load;
        let largest = at_rest.iter().copied().fold(1.0, f64::max);
        let disc = |load: f64| largest_disc_m * (load / largest).sqrt();
        for (wheel, (facts, &[x, y])) in machine.wheels().iter().zip(&contacts).enumerate() {
            let r = facts.radius;
            drawing.polygon("tyre", &tyre([x, y], TYRE_WIDTH * r, r));
            if carries[wheel] && at_rest[wheel] > 0.0 {
                drawing.circle("at-rest", [x, y], disc(at_rest[wheel]));
            }
            let load = self.load(wheel);
            let limit = self
                .analysis
                .min_loads_n
                .as_ref()
                .map_or(0.0, |limits| limits[wheel]);
            if self.contradicted {
                continue;
            }
            if load > 0.0 {
                let class = if load < limit { "load light" } else { "load" };
                drawing.circle(class, [x, y], disc(load));
            } else if load.is_finite() {
                let r = (0.8 * r).max(drawing.metres(LEAST_CROSS));
                drawing.line("lifted", [x - r, y - r], [x + r, y + r]);
                drawing.line("lifted", [x - r, y + r], [x + r, y - r]);
            }
        }
        for [from, to] in &arm {
            drawing.line("arm", *from, *to);
        }
        self.mark_centre(&mut drawing, self.above(&self.placement.centre_of_mass));
        if let Some([x, y]) = self.zmp() {
            let r = drawing.metres(6.0);
            drawing.polygon("zmp", &[[x, y + r], [x + r, y], [x, y - r], [x - r, y]]);
        }
        let mut placed = Vec::new();
        for (wheel, (facts, at)) in machine.wheels().iter().zip(&contacts).enumerate() {
            if !carries[wheel] {
                continue;
            }
            let load = self.load(wheel);
            let is_left = at[0] < (low + high) / 2.0;
            let disc = largest_disc_m * (load.max(at_rest[wheel]) / largest).sqrt();
            let outside = disc.max(0.8 * facts.radius);
            let beside = drawing_shift(&drawing, outside, is_left);
            let anchor = if is_left { Anchor::End } else { Anchor::Start };
            let load = match load.is_finite() {
                // what is off the ground has a cross: what is computed of it is not a load
                _ if self.contradicted || self.off[wheel] => String::new(),
                // plus zero: no sign before zero
                true if largest >= 1000.0 => {
                    decimals(format!("{:.1} kN", (load / 100.0).round() / 10.0 + 0.0))
                }
                true => decimals(format!("{:.1} N", (load * 10.0).round() / 10.0 + 0.0)),
                false => word!("unknown").into(),
            };
            let label: [&str; 2] = [&facts.name, &load];
            let up = drawing.room(*at, beside, label, &arm, &mut placed);
            // far from its wheel it would be read as that of another one
            if up.abs() > FAR {
                let end = [at[0] + drawing.metres(beside), at[1] + drawing.metres(up)];
                drawing.line("guide", *at, end);
            }
            drawing.label(*at, [beside, up], anchor, label);
        }
        let standing: Vec<Point> = self.standing(&contacts).copied().collect();
        if let Some((left, right)) = self.widest_axle(&standing) {
            // below wheels and discs
            let drawn = |wheel: usize| match self.contradicted {
                true => at_rest[wheel].max(0.0),
                false => self.load(wheel).max(0.0).max(at_rest[wheel]),
            };
            let below = |(wheel, at): (usize, &Point)| match carries[wheel] {
                true => at[1] - disc(drawn(wheel)).max(radius),
                false => at[1] - radius,
            };
            let rear = contacts
                .iter()
                .enumerate()
                .map(below)
                .fold(f64::INFINITY, f64::min);
            let name = if self.is_on_wheels() {
                word!("track")
            } else {
                word!("support width")
            };
            drawing.width([left, rear], [right, rear], 14.0, name);
        }
        let pivot = match self.area.axles.is_empty() {
            true => "",
            false => word!("; shaded: what it tips out of, for the axle carries at its pivot"),
        };
        let title = match self.contradicted {
            true => word!(
                "From above, forward is up; no loads are drawn, as those of the stated machine do not show this fall; dashed: load at rest"
            ),
            false => word!(
                "From above, forward is up; disc: load, dashed: at rest, cross: off the ground or no load, diamond: zero moment point"
            ),
        };
        Some(drawing.finish(&format!("{title}{pivot}"), &self.loads_in_words()))
    }

    /// Sideways coordinates of the pair of wheels that stand farthest apart.
    fn widest_axle(&self, contacts: &[Point]) -> Option<(f64, f64)> {
        let wheels = self.analysis.machine.wheels().iter();
        let radius = wheels.map(|wheel| wheel.radius).reduce(f64::max)?;
        let pairs = contacts
            .iter()
            .flat_map(|a| contacts.iter().map(move |b| (a, b)));
        let axles = pairs.filter(|(a, b)| a[0] < b[0] && (a[1] - b[1]).abs() < radius);
        let widest = axles.max_by(|(a, b), (c, d)| (b[0] - a[0]).total_cmp(&(d[0] - c[0])))?;
        Some((widest.0[0], widest.1[0]))
    }

    fn view_across(&self) -> Option<Markup> {
        let machine = &self.analysis.machine;
        let contacts: Vec<Point> = self
            .placement
            .contacts
            .iter()
            .map(|c| self.side(c))
            .collect();
        let wheels: Vec<(Point, f64)> = (contacts.iter().zip(machine.wheels()))
            .map(|(at, wheel)| ([at[0], at[1] + wheel.radius], wheel.radius))
            .collect();
        let arm: Vec<[Point; 2]> = self.arm(Self::side);
        let centre = self.side(&self.placement.centre_of_mass);
        // seen from behind, a tyre is a share of its diameter wide
        let wide = |r: f64| match self.across {
            Across::Length => r,
            Across::Width => TYRE_WIDTH * r,
        };
        let around = |&([x, y], r): &(Point, f64)| [[x - wide(r), y - r], [x + wide(r), y + r]];
        // feet have no radius: a leg as long as the largest wheel is high
        let leg = 2.0 * wheels.iter().map(|wheel| wheel.1).fold(0.2, f64::max);
        let feet = self
            .standing(&contacts)
            .zip(self.standing(machine.wheels()));
        let feet = feet.filter(|(_, support)| support.kind == SupportKind::Foot);
        let feet: Vec<Point> = feet.map(|(at, _)| *at).collect();
        let mut all: Vec<Point> = wheels.iter().flat_map(around).collect();
        all.extend(feet.iter().map(|[x, y]| [*x, y + leg]));
        all.extend(arm.iter().flatten());
        all.push(centre);
        let mut drawing = Drawing::around(&all)?;
        let along = || self.standing(&contacts).map(|contact| contact[0]);
        let (first, last) = (
            along().fold(f64::INFINITY, f64::min),
            along().fold(f64::NEG_INFINITY, f64::max),
        );
        let (low, high) = (
            all.iter().map(|p| p[0]).fold(f64::INFINITY, f64::min),
            all.iter().map(|p| p[0]).fold(f64::NEG_INFINITY, f64::max),
        );
        drawing.line("ground", [low, 0.0], [high, 0.0]);
        for &([x, y], r) in &wheels {
            let half = wide(r);
            match self.across {
                Across::Length => drawing.circle("tyre", [x, y], r),
                Across::Width => drawing.polygon("tyre", &tyre([x, y], half, r)),
            }
        }
        for &[x, y] in &feet {
            let half = drawing.metres(5.0);
            drawing.line("arm", [x, y], [x, y + leg]);
            drawing.line("arm", [x - half, y], [x + half, y]);
        }
        for [from, to] in &arm {
            drawing.line("arm", *from, *to);
        }
        self.mark_centre(&mut drawing, centre);
        let name = match (self.across, self.is_on_wheels()) {
            (Across::Length, true) => word!("wheelbase"),
            (Across::Length, false) => word!("support length"),
            (Across::Width, true) => word!("track"),
            (Across::Width, false) => word!("support width"),
        };
        drawing.width([first, 0.0], [last, 0.0], 12.0, name);
        drawing.height(
            [centre[0], 0.0],
            centre,
            drawing_room(&drawing, centre[0], high),
            word!("centre of mass"),
        );
        let down = &self.down;
        if down.iter().all(|part| part.is_finite()) {
            let right = self.right(down.x, down.y);
            let length = right.hypot(down.z).max(1e-9);
            let r = drawing.metres(30.0);
            let tip = [
                centre[0] + right / length * r,
                centre[1] + down.z / length * r,
            ];
            drawing.line("gravity", centre, tip);
        }
        let from = match self.across {
            Across::Length => word!("From the right, forward is to the right").into(),
            // neither picture has a line for it
            Across::Width => format!(
                "{}; {} {}",
                word!("From behind, left is to the left"),
                match self.is_on_wheels() {
                    true => word!("wheelbase"),
                    false => word!("support length"),
                },
                decimals(format!("{:.2} m", self.length()))
            ),
        };
        let shown = match self.contradicted {
            true => word!("centre of mass of the stated machine, thin line from it: gravity"),
            false => word!("thin line from the centre of mass: gravity"),
        };
        let title = format!("{from}; {shown}");
        Some(drawing.finish(&title, &self.gravity_in_words(centre[1])))
    }

    /// From the rearmost to the foremost support (m).
    fn length(&self) -> f64 {
        let along = || {
            let standing = self.standing(&self.placement.contacts);
            standing.map(|at| self.placement.on_plane(at).x)
        };
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    }

    /// Describes the load of each wheel or other support, and the position of the zero moment point.
    fn loads_in_words(&self) -> String {
        if self.contradicted {
            return String::new();
        }
        let wheels = self.analysis.machine.wheels().iter().enumerate();
        let standing = wheels.filter(|(wheel, _)| self.carries[*wheel]);
        let loads = standing.map(|(wheel, facts)| match self.load(wheel) {
            load if load.is_finite() && self.off[wheel] => say!("{} is off the ground", facts.name),
            load if load.is_nan() => say!("{}: load unknown", facts.name),
            load if load <= 0.0 => say!("{} carries nothing", facts.name),
            load => say!("{} carries {} N", facts.name, number(load)),
        });
        let mut told: Vec<String> = loads.collect();
        if let Some([right, forward]) = self.zmp() {
            told.push(match self.area.is_inside(&Vector2::new(forward, -right)) {
                Some(true) if self.tips => {
                    word!("the zero moment point is at the edge of the supports, within its error")
                        .into()
                }
                Some(true) => word!("the zero moment point is within the supports").into(),
                Some(false) => word!("the zero moment point is not within the supports").into(),
                None => word!("the area of the supports is unknown").into(),
            });
        }
        told.join("; ")
    }

    /// Describes the height of the centre of mass (m), and the side to which gravity leans.
    fn gravity_in_words(&self, height: f64) -> String {
        let height = say!("Centre of mass {height:.2} m above the ground");
        let right = self.right(self.down.x, self.down.y);
        let angle = right.atan2(-self.down.z).to_degrees();
        let side = match (self.across, angle > 0.0) {
            (Across::Length, true) => word!("forward"),
            (Across::Length, false) => word!("backward"),
            (Across::Width, true) => word!("to the right"),
            (Across::Width, false) => word!("to the left"),
        };
        match angle.is_finite() {
            true => say!("{height}; gravity leans {:.1}° {side}", angle.abs()),
            false => say!("{height}; the direction of gravity is unknown"),
        }
    }

    fn arm(&self, project: fn(&Self, &Vector3<f64>) -> Point) -> Vec<[Point; 2]> {
        let segments = self.placement.arm_segments.iter();
        let segments = segments.map(|[from, to]| [project(self, from), project(self, to)]);
        segments
            .filter(|ends| ends.iter().flatten().all(|c| c.is_finite()))
            .collect()
    }

    fn mark_centre(&self, drawing: &mut Drawing, at: Point) {
        if !at.iter().all(|c| c.is_finite()) {
            return;
        }
        let r = drawing.metres(5.0);
        drawing.circle("com", at, r);
        drawing.line("com", [at[0] - r, at[1]], [at[0] + r, at[1]]);
        drawing.line("com", [at[0], at[1] - r], [at[0], at[1] + r]);
    }
}

/// Whether an event is likely and was going on at a row.
fn goes_on(analysis: &Analysis, row: usize, event: &Event) -> bool {
    let rows = &analysis.rows;
    rows.at(event.start_ns) <= row
        && event.end_ns.is_none_or(|end_ns| row < rows.at(end_ns))
        && event.certainty.is_none_or(|certainty| certainty > 0.5)
}

/// Returns whether each wheel is off the ground at a row, by the events.
pub(super) fn off_ground(analysis: &Analysis, row: usize) -> Vec<bool> {
    let is_off = |wheel: &Wheel| {
        let name = wheel.name.to_lowercase();
        analysis.events.iter().any(|event| {
            event.kind == EventKind::WheelLift
                && event.subject == name
                && goes_on(analysis, row, event)
        })
    };
    analysis.machine.wheels().iter().map(is_off).collect()
}

/// Whether the machine tips at a row, by the events.
fn tips(analysis: &Analysis, row: usize) -> bool {
    let is_tipping = |event: &Event| event.kind == EventKind::EdgeTipping;
    let mut tippings = analysis.events.iter().filter(|event| is_tipping(event));
    tippings.any(|event| goes_on(analysis, row, event))
}

/// The smaller of length and width of the rectangle around the points (m), of those that are no line.
fn smaller_span(points: &[Point]) -> f64 {
    let span = |axis: usize| {
        let along = || points.iter().map(|point| point[axis]);
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    };
    let spans = [span(0), span(1)].into_iter().filter(|span| *span > 0.01);
    spans.reduce(f64::min).unwrap_or(1.0)
}

/// The corners of a tyre seen from above or from behind, by half of its width and of its length.
fn tyre([x, y]: Point, half: f64, r: f64) -> [Point; 4] {
    [
        [x - half, y - r],
        [x + half, y - r],
        [x + half, y + r],
        [x - half, y + r],
    ]
}

/// Returns the shift to the beginning of a wheel's label: beyond its disc, in the picture's own units.
fn drawing_shift(drawing: &Drawing, outside_m: f64, is_left: bool) -> f64 {
    let outside = outside_m / drawing.metres(1.0) + 4.0;
    if is_left { -outside } else { outside }
}

/// Distance from a point to beyond the right end, in the picture's own units.
fn drawing_room(drawing: &Drawing, from: f64, end: f64) -> f64 {
    (end - from) / drawing.metres(1.0) + 6.0
}
