//! The path on the ground, coloured by utilisation.

use maud::{Markup, html};
use tipwatch_mechanics::{Quantity, State};

use super::drawing::{Anchor, Drawing, Point};
use super::findings::Scene;
use super::worst;
use crate::analysis::Analysis;
use crate::page::number;

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

/// A point of the path.
#[derive(Debug, Clone, Copy)]
struct Place {
    row: usize,
    at: Point,
}

/// The section; `None` if the log has no odometry, or the machine stood.
pub(super) fn section(analysis: &Analysis) -> Option<Markup> {
    let places = places(analysis)?;
    let step = places.len().div_ceil(MOST_PIECES).max(1);
    let points: Vec<Point> = places.iter().map(|place| place.at).collect();
    let mut drawing = Drawing::around(&points)?;
    for piece in places.chunks(step).zip(places.chunks(step).skip(1)) {
        let (from, to) = (piece.0[0], piece.1[0]);
        // the worst of the piece, not its first row
        let used = piece.0.iter().map(|place| utilisation(analysis, place.row));
        drawing.line(class(used.fold(f64::NAN, f64::max)), from.at, to.at);
    }
    let (first, last) = (places.first()?, places.last()?);
    let r = drawing.metres(3.0);
    drawing.circle("com", first.at, r);
    drawing.text(first.at, [5.0, 4.0], Anchor::Start, "start");
    drawing.circle("load", last.at, r);
    drawing.text(last.at, [5.0, -10.0], Anchor::Start, "end");
    if let Some(worst) = worst::row(analysis)
        && let Some(place) = places.iter().min_by_key(|place| place.row.abs_diff(worst))
    {
        let [x, y] = place.at;
        let r = drawing.metres(6.0);
        drawing.polygon("zmp", &[[x, y + r], [x + r, y], [x, y - r], [x - r, y]]);
        drawing.text([x, y], [-8.0, 4.0], Anchor::End, "worst");
    }
    let length: f64 = places
        .windows(2)
        .map(|pair| distance(pair[0].at, pair[1].at))
        .sum();
    let times = Scene::of(analysis);
    let (from, to) = (first.row, last.row);
    let seconds = |row: usize| times.seconds(analysis.rows.times_ns[row]);
    Some(html! {
        p {
            "The path of the base, " (number(length)) " m from t = " (format_args!("{:.1}", seconds(from))) " s to "
            (format_args!("{:.1}", seconds(to))) " s, integrated from the velocity of the odometry and the angular velocity of the \
            IMU: its shape drifts with time. Forward at the start is up."
        }
        (drawing.finish("Path, coloured by utilisation", true))
        p.hint {
            "Utilisation is one minus the smallest load of a wheel as a share of its load at rest: "
            span.used-low { "below 75 %" } ", " span.used-notice { "from 75 %" } ", " span.used-warning { "from 90 %" } ", "
            span.used-limit { "100 %: a wheel without load under the stated split" } ", " span.used-unknown { "unknown" }
            ". The limits are our choice, modelled on crane practice."
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

/// One minus the smallest load as a share of the load at rest; NaN where unknown.
fn utilisation(analysis: &Analysis, row: usize) -> f64 {
    if !analysis.rows.reasons[row].leave_loads() {
        return f64::NAN;
    }
    let share = |wheel: usize| {
        let load = analysis.rows.outcomes.column(Quantity::Load(wheel))[row];
        load / analysis.machine.reference().static_load[wheel]
    };
    let wheels = 0..analysis.machine.wheels().len();
    let shares = wheels.map(share);
    1.0 - shares.fold(f64::INFINITY, |least, share| {
        if share.is_nan() {
            share
        } else {
            least.min(share)
        }
    })
}

/// x' = R(psi) v, psi' = w . up: position and heading of the base from its velocity and yaw rate.
fn places(analysis: &Analysis) -> Option<Vec<Place>> {
    let (machine, rows) = (&analysis.machine, &analysis.rows);
    if !analysis
        .inputs
        .iter()
        .any(|input| input.signal == "odometry")
        || machine.imu().body != 0
    {
        return None;
    }
    let base_from_imu = machine.imu().body_from_mount.rotation;
    let mut state = State::zero(machine);
    let (mut at, mut heading) = ([0.0, 0.0], 0.0_f64);
    let mut places: Vec<Place> = Vec::new();
    let mut before: Option<(f64, [f64; 2], f64)> = None;
    for row in 0..rows.len() {
        rows.states.get(row, &mut state);
        let up = match state.base.up.iter().all(|part| part.is_finite()) {
            true => state.base.up,
            false => nalgebra::Vector3::z(),
        };
        let yaw_rate = (base_from_imu * state.imu.angular_velocity).dot(&up);
        let velocity = [state.base.velocity.x, state.base.velocity.y];
        let now = rows.seconds(row);
        let is_known = velocity.iter().all(|v| v.is_finite()) && yaw_rate.is_finite();
        if !is_known {
            // the path ends where it is no longer known
            if places.is_empty() {
                continue;
            }
            break;
        }
        if let Some((then, old, old_rate)) = before {
            let dt = now - then;
            let middle = heading + 0.25 * (old_rate + yaw_rate) * dt;
            let (sin, cos) = middle.sin_cos();
            let mean = [(old[0] + velocity[0]) / 2.0, (old[1] + velocity[1]) / 2.0];
            // forward is up in the picture, left is left
            at[1] += (cos * mean[0] - sin * mean[1]) * dt;
            at[0] -= (sin * mean[0] + cos * mean[1]) * dt;
            heading += 0.5 * (old_rate + yaw_rate) * dt;
        }
        before = Some((now, velocity, yaw_rate));
        places.push(Place { row, at });
    }
    let start = places.first()?.at;
    let moved = places
        .iter()
        .any(|place| distance(place.at, start) > SHORTEST_M);
    moved.then_some(places)
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
