//! Wheels and steering compared with the travel of the machine.
//!
//! A wheel with the rolling direction t at p turns by
//! ```text
//!     R omega = b1 (t . v) + b2 (t . (w x p)),        b1 = b2 = 1
//! ```
//! b1 is its sign and scale. b2 shows, in curves, on which side it is. The angle that a steering joint should have is
//! that at which its wheels do not slip sideways.

use nalgebra::Vector3;

use super::estimate::{Estimate, Relation};
use super::least_squares::Equations;
use super::roles::{Role, Roles};
use super::signals::View;
use super::travel::{Travel, WheelColumns};
use tipwatch_mechanics::machine::Machine;

/// Speed below which a wheel's direction of travel is uncertain (m/s).
const SLOW: f64 = 0.25;

/// Least standard deviation of a wheel's speed and of its part by a curve (m/s), and of a steering angle (rad).
const ROLLS: f64 = 0.1;
const TURNS: f64 = 0.06;
const STEERS: f64 = 0.05;
/// Least standard deviation of the difference of two wheels' paths that shows their order (m/s).
const PARTS: f64 = 0.008;
/// Wheels of one side are no farther apart across (m).
const ONE_SIDE: f64 = 0.1;
/// Yaw rate of a curve (rad/s), and the fewest bins of curves.
const CURVE: f64 = 0.15;
const FEWEST: usize = 20;

/// The wheels' rotation.
pub(super) fn wheels(view: &View, travel: &Travel, skids: bool) -> Vec<Estimate> {
    let mut found = Vec::new();
    for wheel in &travel.wheels {
        let mut equations = Equations::new(2).excited(0, ROLLS).excited(1, TURNS);
        for k in (0..view.bins).filter(|&k| view.is_upright[k]) {
            let along = wheel.along[k];
            let turned = Vector3::z().cross(&wheel.centre[k]) * view.turning[k].z;
            equations.add(
                &[along.dot(&travel.velocity[k]), along.dot(&turned)],
                wheel.speed[k],
            );
        }
        let solution = equations.solve();
        let straight = solution.as_ref().map(|s| s.of(0));
        let straight = straight.or_else(|| along_alone(view, travel, wheel));
        if let Some(straight) = straight {
            found.push(Estimate::of(Relation::Wheel(wheel.joint), straight));
        }
        found.extend(in_curves(view, travel, wheel).filter(|_| !skids));
        if let Some(solution) = solution {
            // Wheels that slip sideways turn more than the curve needs: only the sign tells.
            let [value, sigma] = solution.of(1);
            let side = |value: f64| Estimate::of(Relation::WheelSide(wheel.joint), [value, sigma]);
            found.push(match skids {
                true => side(value.clamp(-1.0, 1.0)).within([0.8, 1.2]),
                false => side(value),
            });
        }
    }
    found
}

/// Wheels of one side whose paths differ in curves: which of them rolls faster.
///
/// ```text
///     s_a - s_b = b d + c (s_a + s_b) / 2,    d: the same difference by the paths of the wheels
/// ```
/// b is 1, and -1 if the two are exchanged. c is what their radii are off by.
pub(super) fn order(view: &View, travel: &Travel) -> Vec<Estimate> {
    let mut found = Vec::new();
    for (place, a) in travel.wheels.iter().enumerate() {
        for b in &travel.wheels[place + 1..] {
            let mut equations = Equations::new(2).excited(0, PARTS);
            for k in (0..view.bins).filter(|&k| view.is_upright[k]) {
                if (a.centre[k].y - b.centre[k].y).abs() > ONE_SIDE {
                    continue;
                }
                let path = |wheel: &WheelColumns| {
                    let turned = Vector3::z().cross(&wheel.centre[k]) * view.turning[k].z;
                    wheel.along[k].dot(&(travel.velocity[k] + turned))
                };
                let mean = 0.5 * (a.speed[k] + b.speed[k]);
                equations.add(&[path(a) - path(b), mean], a.speed[k] - b.speed[k]);
            }
            if let Some(solution) = equations.solve() {
                let relation = Relation::WheelOrder(a.joint, b.joint);
                found.push(Estimate::of(relation, solution.of(0)));
            }
        }
    }
    found
}

/// Estimates the deviation of a wheel's speed from that of its path in curves: root mean square, as a share of the speed.
fn in_curves(view: &View, travel: &Travel, wheel: &WheelColumns) -> Option<Estimate> {
    let turns = (0..view.bins).filter(|&k| view.is_upright[k] && view.turning[k].z.abs() > CURVE);
    let pairs = turns.map(|k| {
        let turned = Vector3::z().cross(&wheel.centre[k]) * view.turning[k].z;
        (
            wheel.along[k].dot(&(travel.velocity[k] + turned)),
            wheel.speed[k],
        )
    });
    let pairs: Vec<(f64, f64)> = pairs
        .filter(|(p, s)| p.is_finite() && s.is_finite())
        .collect();
    let size: f64 = pairs.iter().map(|(path, _)| path * path).sum();
    let off: f64 = pairs
        .iter()
        .map(|(path, speed)| (speed - path).powi(2))
        .sum();
    let off = [(off / size).sqrt(), 0.01];
    (pairs.len() >= FEWEST && size > ROLLS * ROLLS * pairs.len() as f64)
        .then(|| Estimate::of(Relation::WheelCurve(wheel.joint), off))
}

/// b1 without any curve.
fn along_alone(view: &View, travel: &Travel, wheel: &WheelColumns) -> Option<[f64; 2]> {
    let mut equations = Equations::new(1).excited(0, ROLLS);
    for k in (0..view.bins).filter(|&k| view.is_upright[k]) {
        equations.add(&[wheel.along[k].dot(&travel.velocity[k])], wheel.speed[k]);
    }
    Some(equations.solve()?.of(0))
}

/// A wheel that a steering joint steers, and its sign; see [`Role::Steer`].
pub(super) fn steered_wheel<'t>(
    machine: &Machine,
    roles: &Roles,
    travel: &'t Travel,
    joint: usize,
) -> Option<(&'t WheelColumns, f64)> {
    let Role::Steer { wheels, sign } = roles.of(joint) else {
        return None;
    };
    let is_steered = |columns: &&WheelColumns| {
        let wheel = machine.joints()[columns.joint].spins_wheel;
        wheel.is_some_and(|wheel| wheels.contains(&wheel))
    };
    Some((travel.wheels.iter().find(is_steered)?, *sign))
}

/// Velocity of a wheel's centre in a bin in which it rolls fast enough to show its direction (m/s).
pub(super) fn rolling_velocity(
    view: &View,
    travel: &Travel,
    wheel: &WheelColumns,
    bin: usize,
) -> Option<Vector3<f64>> {
    let turned = Vector3::z().cross(&wheel.centre[bin]) * view.turning[bin].z;
    let velocity = travel.velocity[bin] + turned;
    let is_fast = velocity.xy().norm() >= SLOW;
    (view.is_upright[bin] && is_fast).then_some(velocity)
}

/// The steering joints' angles.
pub(super) fn steering(
    machine: &Machine,
    roles: &Roles,
    view: &View,
    travel: &Travel,
) -> Vec<Estimate> {
    let mut found = Vec::new();
    for joint in roles.joints(|role| matches!(role, Role::Steer { .. })) {
        let Some((wheel, sign)) = steered_wheel(machine, roles, travel, joint) else {
            continue;
        };
        let mut equations = Equations::new(2).excited(0, STEERS);
        let mut squares = [0.0, 0.0];
        for k in 0..view.bins {
            let Some(velocity) = rolling_velocity(view, travel, wheel, k) else {
                continue;
            };
            let along = wheel.along[k];
            // Steering angles stay below 90 degrees.
            let velocity = velocity * travel.velocity[k].x.signum();
            let off = (along.x * velocity.y - along.y * velocity.x).atan2(along.dot(&velocity));
            let angle = view.joints[joint].position[k];
            equations.add(&[angle + sign * off, 1.0], angle);
            if off.is_finite() && angle.is_finite() {
                squares[0] += off * off;
                squares[1] += (angle + sign * off).powi(2);
            }
        }
        if let Some(solution) = equations.solve() {
            found.push(Estimate::of(Relation::Steer(joint), solution.of(0)));
            let off = [(squares[0] / squares[1]).sqrt(), 0.01];
            found.push(Estimate::of(Relation::SteerOff(joint), off));
        }
    }
    found
}
