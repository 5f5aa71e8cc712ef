//! The path on the ground, coloured by utilisation.

use maud::{Markup, html};
use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{Quantity, State};

use super::drawing::{Anchor, Drawing, Point};
use super::findings::Scene;
use super::sheet;
use crate::analysis::Analysis;
use crate::base::rows::Rows;
use crate::page::{number, percent};

/// Most pieces of the path: more than a reader can tell apart.
const MOST_PIECES: usize = 400;
/// A path shorter than this is noise (m).
const SHORTEST_M: f64 = 0.5;
/// Utilisation from which a piece has the next colour, modelled on crane practice.
const BANDS: [(f64, &str); 4] = [
    (0.0, "used-low"),
    (0.75, "used-notice"),
    (0.9, "used-warning"),
    (1.0, "used-limit"),
];

/// The path of the base.
#[derive(Debug)]
pub(super) struct Path {
    /// Its pieces, and its last point.
    pieces: Vec<Piece>,
    last: Place,
    length_m: f64,
}

/// A point of the path.
#[derive(Debug, Clone, Copy)]
struct Place {
    row: usize,
    at: Point,
}

/// Some points of the path.
#[derive(Debug, Clone, Copy)]
struct Piece {
    first: Place,
    /// The largest utilisation, not that of the first point; NaN where unknown.
    used: f64,
    points: usize,
}

/// The section; `None` if the log has no odometry, or the machine stood.
pub(super) fn section(analysis: &Analysis, path: Option<&Path>) -> Option<Markup> {
    // without odometry the velocity of the base is that of the wheels
    let has_odometry = (analysis.inputs.iter()).any(|input| input.signal == "odometry");
    let path = path.filter(|_| has_odometry)?;
    let points: Vec<Point> = path.pieces.iter().map(|piece| piece.first.at).collect();
    let mut drawing = Drawing::around(&points)?;
    let (first, last) = (path.pieces.first()?.first, path.last);
    // what has one colour is one line, up to where the next one begins
    let mut begun = 0;
    for pieces in (path.pieces).chunk_by(|a, b| class(a.used) == class(b.used)) {
        begun += pieces.len();
        let next = path.pieces.get(begun).map_or(last, |piece| piece.first);
        let line: Vec<Point> = (pieces.iter())
            .map(|piece| piece.first.at)
            .chain([next.at])
            .collect();
        drawing.polyline(class(pieces[0].used), &line);
    }
    let r = drawing.metres(3.0);
    drawing.circle("com", first.at, r);
    drawing.text(first.at, [5.0, 4.0], Anchor::Start, word!("start"));
    drawing.circle("load", last.at, r);
    drawing.text(last.at, [5.0, -10.0], Anchor::Start, word!("end"));
    if let Some(worst) = sheet::row(analysis)
        && let Some(place) = (path.pieces.iter().map(|piece| piece.first))
            .min_by_key(|place| place.row.abs_diff(worst))
    {
        let [x, y] = place.at;
        let r = drawing.metres(6.0);
        drawing.polygon("zmp", &[[x, y + r], [x + r, y], [x, y - r], [x - r, y]]);
        drawing.text([x, y], [-8.0, 4.0], Anchor::End, word!("worst"));
    }
    let times = Scene::of(analysis);
    let (from, to) = (first.row, last.row);
    let seconds = |row: usize| times.seconds(analysis.rows.times_ns[row]);
    let told = say!(
        "The path of the base, {} m from t = {:.1} s to {:.1} s, integrated from the velocity of the odometry and the angular \
        velocity of the IMU: its shape drifts with time. Forward at the start is up.",
        number(path.length_m),
        seconds(from),
        seconds(to)
    );
    let used = path.pieces.iter().map(|piece| piece.used);
    let found = match used.fold(f64::NAN, f64::max) {
        used if used.is_finite() => say!("Greatest utilisation on it: {}", percent(used)),
        _ => word!("The utilisation on it is unknown").into(),
    };
    Some(html! {
        p { (told) }
        (drawing.finish(word!("Path, coloured by utilisation"), &found))
        p.hint {
            (say!("Utilisation is one minus the smallest load of a {} as a share of its load at rest: ", times.word.one))
            span.used-low { (word!("below 75 %")) } ", " span.used-notice { (word!("from 75 %")) } ", "
            span.used-warning { (word!("from 90 %")) } ", "
            span.used-limit { (say!("100 %: a {} without load under the stated split", times.word.one)) } ", "
            span.used-unknown { (word!("unknown")) } (word!(". The limits are our choice, modelled on crane practice."))
        }
    })
}

fn distance(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn class(used: f64) -> &'static str {
    let band = BANDS.iter().rev().find(|(from, _)| used >= *from);
    match band {
        Some((_, class)) => class,
        None if used < 0.0 => BANDS[0].1,
        None => "used-unknown",
    }
}

/// x' = R(psi) v, psi' = w . up: position and heading of the base from its velocity and yaw rate, row by row.
#[derive(Debug, Default)]
pub(super) struct PathPass {
    /// Whether the IMU is on the base.
    is_possible: bool,
    /// Whether the path has ended.
    is_over: bool,
    at: Point,
    heading: f64,
    before: Option<(f64, [f64; 2], f64)>,
    start: Point,
    farthest_m: f64,
    length_m: f64,
    last: Option<Place>,
    pieces: Vec<Piece>,
    /// Points of a piece.
    step: usize,
}

impl PathPass {
    pub(super) fn new(machine: &Machine) -> Self {
        Self {
            is_possible: machine.imu().body == 0,
            step: 1,
            ..Self::default()
        }
    }

    /// Takes the next rows.
    pub(super) fn add(&mut self, machine: &Machine, rows: &Rows) {
        if !self.is_possible || self.is_over {
            return;
        }
        let base_from_imu = machine.imu().body_from_mount.rotation;
        let loads: Vec<&[f64]> = (0..machine.wheels().len())
            .map(|wheel| rows.outcomes.column(Quantity::Load(wheel)))
            .collect();
        let static_load = &machine.reference().static_load;
        let mut state = State::zero(machine);
        for row in 0..rows.len() {
            rows.states.get(row, &mut state);
            let up = (state.base.known_up()).unwrap_or_else(nalgebra::Vector3::z);
            let yaw_rate = (base_from_imu * state.imu.angular_velocity).dot(&up);
            let velocity = [state.base.velocity.x, state.base.velocity.y];
            let is_known = velocity.iter().all(|v| v.is_finite()) && yaw_rate.is_finite();
            if !is_known {
                // the path ends where it is no longer known
                if self.last.is_some() {
                    self.is_over = true;
                    return;
                }
                continue;
            }
            self.move_on(rows.seconds(row), velocity, yaw_rate);
            let used = match rows.reasons[row].leave_loads() {
                true => utilisation(loads.iter().map(|load| load[row]).zip(static_load)),
                false => f64::NAN,
            };
            self.place(rows.first + row, used);
        }
    }

    fn move_on(&mut self, now: f64, velocity: [f64; 2], yaw_rate: f64) {
        if let Some((then, old, old_rate)) = self.before {
            let dt = now - then;
            let middle = self.heading + 0.25 * (old_rate + yaw_rate) * dt;
            let (sin, cos) = middle.sin_cos();
            let mean = [(old[0] + velocity[0]) / 2.0, (old[1] + velocity[1]) / 2.0];
            // forward is up in the picture, left is left
            self.at[1] += (cos * mean[0] - sin * mean[1]) * dt;
            self.at[0] -= (sin * mean[0] + cos * mean[1]) * dt;
            self.heading += 0.5 * (old_rate + yaw_rate) * dt;
        }
        self.before = Some((now, velocity, yaw_rate));
    }

    fn place(&mut self, row: usize, used: f64) {
        let place = Place { row, at: self.at };
        match self.last {
            Some(last) => self.length_m += distance(last.at, place.at),
            None => self.start = place.at,
        }
        self.farthest_m = self.farthest_m.max(distance(place.at, self.start));
        self.last = Some(place);
        match self.pieces.last_mut() {
            Some(piece) if piece.points < self.step => {
                piece.points += 1;
                // the maximum of known values
                piece.used = piece.used.max(used);
            }
            _ => self.pieces.push(Piece {
                first: place,
                used,
                points: 1,
            }),
        }
        if self.pieces.len() > MOST_PIECES {
            self.step *= 2;
            let pairs = self.pieces.chunks(2).map(|pair| Piece {
                used: pair.iter().map(|piece| piece.used).fold(f64::NAN, f64::max),
                points: pair.iter().map(|piece| piece.points).sum(),
                ..pair[0]
            });
            self.pieces = pairs.collect();
        }
    }

    /// The path; `None` if the machine stood or its motion is unknown.
    pub(super) fn finish(self) -> Option<Path> {
        (self.farthest_m > SHORTEST_M).then_some(Path {
            pieces: self.pieces,
            last: self.last?,
            length_m: self.length_m,
        })
    }
}

/// One minus the smallest load as a share of the load at rest; NaN where unknown.
fn utilisation<'a>(loads: impl Iterator<Item = (f64, &'a f64)>) -> f64 {
    let shares = loads.map(|(load, at_rest)| load / at_rest);
    1.0 - shares.fold(f64::INFINITY, |least, share| {
        if share.is_nan() {
            share
        } else {
            least.min(share)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_piece_is_coloured_by_its_band_and_unknown_is_no_band() {
        assert_eq!(class(0.2), "used-low");
        assert_eq!(class(-0.3), "used-low");
        assert_eq!(class(0.75), "used-notice");
        assert_eq!(class(1.2), "used-limit");
        assert_eq!(class(f64::NAN), "used-unknown");
    }
}
