//! Specific force, angular velocity and travel compared with each other.
//!
//! With the acceleration a of the base origin by the odometry (or the wheels), the specific force of an IMU that is
//! mounted as the machine file says is
//! ```text
//!     f_x = a_x + m_x + s_x cos(psi) + s_y sin(psi)
//!     f_y = a_y + m_y - s_x sin(psi) + s_y cos(psi)
//! ```
//! with psi the heading since the start, s the slope of the ground (gravity times its gradient), constant in the world,
//! and m the tilt of the IMU against the platform, constant in the machine. Turning tells them apart. Fitted with a
//! matrix A before a: A is the identity where sign, axes, direction and scale are right.

use nalgebra::Vector3;

use super::estimate::{Estimate, Relation, Yaw};
use super::grid::STEP_S;
use super::least_squares::Equations;
use super::signals::View;
use super::travel::{Source, Travel};
use tipwatch_mechanics::machine::Machine;

/// Change of heading from which slope and mounting are told apart (rad): three quarters of a circle.
const CIRCLE: f64 = 4.7;
/// Least standard deviation of a forward acceleration (m/s^2), a yaw rate (rad/s) and a tilt (rad) that show something.
const ACCELERATES: f64 = 0.08;
const TURNS: f64 = 0.05;
const TILTS: f64 = 0.003;
/// Fewest bins at rest.
const FEWEST: usize = 8;

/// Estimates the length of the specific force at rest, and its direction against the normal of level ground.
pub(super) fn at_rest(
    machine: &Machine,
    view: &View,
    travel: &Travel,
    normal: &Vector3<f64>,
) -> Vec<Estimate> {
    let rest = (0..view.bins).filter(|&k| travel.source == Source::Nothing || travel.stands[k]);
    let forces: Vec<Vector3<f64>> = (rest.map(|k| view.force[k]))
        .filter(|f| f.iter().all(|x| x.is_finite()))
        .collect();
    if forces.len() < FEWEST {
        return Vec::new();
    }
    let count = forces.len() as f64;
    let mean = forces.iter().sum::<Vector3<f64>>() / count;
    let scatter = (forces
        .iter()
        .map(|f| (f - mean).norm_squared())
        .sum::<f64>()
        / count)
        .sqrt();
    // Bins alike in their neighbourhood count as a tenth.
    let sigma = scatter / (count / 10.0).max(1.0).sqrt();
    let angle = mean.cross(normal).norm().atan2(mean.dot(normal));
    let gravity = [mean.norm(), sigma].map(|force| force / machine.gravity());
    let gravity = [gravity[0], gravity[1] + 0.001];
    let up = [angle, sigma / mean.norm().max(1e-3) + 0.001];
    vec![
        Estimate::of(Relation::Gravity, gravity),
        Estimate::of(Relation::Up, up),
    ]
}

/// Heading since the start (rad), by the angular velocity about z.
fn heading(view: &View) -> Vec<f64> {
    let mut heading = 0.0;
    let step = |turning: &Vector3<f64>| {
        heading += if turning.z.is_finite() {
            turning.z * STEP_S
        } else {
            0.0
        };
        heading
    };
    view.turning.iter().map(step).collect()
}

/// While the machine drives: the matrix A, its direction, and the tilt of the IMU.
pub(super) fn driving(
    machine: &Machine,
    view: &View,
    travel: &Travel,
    normal: &Vector3<f64>,
) -> Vec<Estimate> {
    if travel.source == Source::Nothing {
        return Vec::new();
    }
    let heading = heading(view);
    let range = |values: &[f64]| {
        let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        largest - values.iter().copied().fold(f64::INFINITY, f64::min)
    };
    let has_circled = range(&heading) > CIRCLE;
    let unknowns = if has_circled { 8 } else { 6 };
    let mut equations = Equations::new(unknowns).excited(0, ACCELERATES);
    for row in 0..2 {
        for k in (0..view.bins).filter(|&k| view.is_upright[k]) {
            let (sin, cos) = heading[k].sin_cos();
            let a = travel.acceleration[k];
            let all = match row {
                0 => [a.x, a.y, 0.0, 0.0, 1.0, 0.0, cos, sin],
                _ => [0.0, 0.0, a.x, a.y, 0.0, 1.0, -sin, cos],
            };
            equations.add(&all[..unknowns], view.force[k][row]);
        }
    }
    let Some(solution) = equations.solve() else {
        return Vec::new();
    };
    let element = |row: usize, column: usize| {
        let element = solution.of(2 * row + column);
        Estimate::of(Relation::Drive(row, column), element)
    };
    let matrix = [element(0, 0), element(0, 1), element(1, 0), element(1, 1)];
    let mut found = matrix.to_vec();
    found.extend(direction(&matrix));
    if has_circled {
        let tilt = |axis: usize| {
            // About x the IMU sees gravity in y; about y in minus x.
            let (at, sign) = [(5, 1.0), (4, -1.0)][axis];
            let lean = [normal.y, -normal.x][axis];
            let [value, sigma] = solution.of(at);
            let (tilt, sigma) = (sign * value / machine.gravity(), sigma / machine.gravity());
            Estimate::of(Relation::Mount(axis), [tilt - lean, sigma])
        };
        found.extend([tilt(0), tilt(1)]);
    }
    found
}

/// Direction in which the IMU sees the machine's forward acceleration: the angle of the rotation nearest to A.
fn direction(matrix: &[Estimate; 4]) -> Option<Estimate> {
    let [xx, xy, yx, yy] = matrix;
    // Each column is a direction: that of forward acceleration, and that of acceleration to the left.
    let angle = |along: &Estimate, across: &Estimate, sign: f64| {
        let length = along.value.hypot(across.value);
        let sigma = across.sigma.max(along.sigma) / length;
        let is_sure = length > 0.25 && sigma < 0.15;
        is_sure.then(|| ((sign * across.value).atan2(along.value), sigma))
    };
    let (value, sigma) = match (angle(xx, yx, 1.0), angle(yy, xy, -1.0)) {
        // Directions far apart are no rotation: the surer one counts, and the elements of A show the rest.
        (Some((a, s)), Some((b, t))) if (a - b).abs() < 0.5 => {
            let (p, q) = (s.powi(-2), t.powi(-2));
            ((a * p + b * q) / (p + q), (p + q).powf(-0.5))
        }
        (Some(a), Some(b)) => {
            if a.1 < b.1 {
                a
            } else {
                b
            }
        }
        (Some(only), None) | (None, Some(only)) => only,
        (None, None) => return None,
    };
    Some(Estimate::of(Relation::DriveDirection, [value, sigma]))
}

/// Angular velocity per yaw rate by each other sensor of it.
pub(super) fn turning(view: &View, travel: &Travel, skids: bool) -> Vec<Estimate> {
    let by_attitude = |k: usize| view.attitude_turning[k].z;
    type Rate<'a> = &'a dyn Fn(usize) -> f64;
    let sources: [(Yaw, Rate<'_>); 3] = [
        (Yaw::Odometry, &|k| view.odometry_turning[k].z),
        (Yaw::Wheels, &|k| travel.wheel_yaw[k]),
        (Yaw::Attitude, &by_attitude),
    ];
    let mut found = Vec::new();
    for (source, yaw) in sources {
        for axis in 0..3 {
            let mut equations = Equations::new(2).excited(0, TURNS);
            for k in 0..view.bins {
                if view.is_upright[k] {
                    equations.add(&[yaw(k), 1.0], view.turning[k][axis]);
                }
            }
            let Some(solution) = equations.solve() else {
                continue;
            };
            let turn = Estimate::of(Relation::Turn(source, axis), solution.of(0));
            found.push(match (source, axis) {
                (Yaw::Wheels, 2) if skids => turn.within([0.8, 1.3]),
                _ => turn,
            });
        }
    }
    found
}

/// The attitude's tilt per tilt by the specific force without acceleration, and the angle between them at rest.
pub(super) fn attitude(machine: &Machine, view: &View, travel: &Travel) -> Vec<Estimate> {
    let mut found = Vec::new();
    for axis in 0..2 {
        let mut equations = Equations::new(2).excited(0, TILTS);
        for k in (0..view.bins).filter(|&k| view.is_upright[k]) {
            let tilt = (view.force[k] - travel.acceleration[k])[axis] / machine.gravity();
            equations.add(&[view.up[k][axis], 1.0], tilt);
        }
        if let Some(solution) = equations.solve() {
            found.push(Estimate::of(Relation::AttitudeTilt(axis), solution.of(0)));
        }
    }
    let resting = (0..view.bins).filter(|&k| travel.stands[k]);
    let pairs = resting.map(|k| (view.up[k], view.force[k]));
    let known = |v: &Vector3<f64>| v.iter().all(|x| x.is_finite());
    let pairs: Vec<_> = pairs
        .filter(|(up, force)| known(up) && known(force))
        .collect();
    if pairs.len() >= FEWEST {
        let up = pairs.iter().map(|pair| pair.0).sum::<Vector3<f64>>();
        let force = pairs.iter().map(|pair| pair.1).sum::<Vector3<f64>>();
        let angle = up.cross(&force).norm().atan2(up.dot(&force));
        found.push(Estimate::of(Relation::AttitudeUp, [angle, 0.002]));
    }
    found
}
