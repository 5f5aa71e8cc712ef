//! Travel of the machine by its odometry or its wheels, and the motion expected of each wheel.

use nalgebra::{Matrix3, Vector3};

use super::grid::{derivative, of_vectors, smooth};
use super::roles::{Role, Roles};
use super::signals::View;
use tipwatch_mechanics::dynamics::kinematics::RestingBodies;
use tipwatch_mechanics::geometry::spatial::z_axis;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::State;

/// Speed that noise may show while a machine stands (m/s).
const STANDING: f64 = 0.06;
/// Weight of "a wheel does not slip sideways" beside "it rolls": less, because a machine without steering slips.
const LATERAL_WEIGHT: f64 = 0.3;

/// Motion of the base, and the kinematics of its wheels, by bin.
#[derive(Debug, Clone)]
pub(super) struct Travel {
    /// Sensors that give the velocity, if any.
    pub(super) source: Source,
    /// Velocity (m/s, base axes, smoothed).
    pub(super) velocity: Vec<Vector3<f64>>,
    /// Acceleration of the base origin without gravity (m/s^2, base axes).
    pub(super) acceleration: Vec<Vector3<f64>>,
    /// Yaw rate by the wheels (rad/s).
    pub(super) wheel_yaw: Vec<f64>,
    /// The wheels whose rotation is measured.
    pub(super) wheels: Vec<WheelColumns>,
    /// Whether the machine stands still in each bin, by all signals that show it.
    pub(super) stands: Vec<bool>,
}

/// Sensor of the velocity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    Odometry,
    Wheels,
    Nothing,
}

/// A wheel with a measured rotation.
#[derive(Debug, Clone)]
pub(super) struct WheelColumns {
    /// Its spin joint.
    pub(super) joint: usize,
    /// Rolling direction, by bin.
    pub(super) along: Vec<Vector3<f64>>,
    /// Centre (m), by bin.
    pub(super) centre: Vec<Vector3<f64>>,
    /// Speed of its circumference (m/s).
    pub(super) speed: Vec<f64>,
}

impl Travel {
    /// `wheels` are those of another view in which the joints move alike.
    pub(super) fn of(
        machine: &Machine,
        roles: &Roles,
        view: &View,
        wheels: Option<&[WheelColumns]>,
    ) -> Self {
        let wheels = wheels.map_or_else(|| self::wheels(machine, roles, view), <[_]>::to_vec);
        let (by_wheels, wheel_yaw) = twist(&wheels, view.bins);
        let by_odometry = of_vectors(&view.velocity, smooth);
        let is_known = |all: &[Vector3<f64>]| all.iter().any(|v| v.x.is_finite());
        let (source, velocity, raw) = if is_known(&by_odometry) {
            (Source::Odometry, by_odometry, view.velocity.clone())
        } else if is_known(&by_wheels) {
            (Source::Wheels, by_wheels.clone(), by_wheels)
        } else {
            (Source::Nothing, by_odometry, view.velocity.clone())
        };
        let change = of_vectors(&raw, derivative);
        let acceleration = (0..view.bins)
            .map(|k| change[k] + view.turning[k].cross(&velocity[k]))
            .collect();
        let stands = (0..view.bins).map(|k| {
            let rolls = wheels.iter().any(|wheel| wheel.speed[k].abs() > STANDING);
            let moves = velocity[k].xy().norm() > STANDING;
            let is_told =
                velocity[k].x.is_finite() || wheels.iter().any(|w| w.speed[k].is_finite());
            is_told && !rolls && !moves
        });
        Self {
            source,
            stands: stands.collect(),
            velocity,
            acceleration,
            wheel_yaw,
            wheels,
        }
    }
}

/// Rolling directions, centres and speeds of the wheels whose rotation is measured.
fn wheels(machine: &Machine, roles: &Roles, view: &View) -> Vec<WheelColumns> {
    let spinning: Vec<(usize, usize, usize)> = (0..machine.joints().len())
        .filter_map(|joint| match roles.of(joint) {
            Role::Wheel { wheel, body } => Some((joint, *wheel, *body)),
            _ => None,
        })
        .filter(|(joint, ..)| {
            view.joints[*joint]
                .measured_rate
                .iter()
                .chain(&view.joints[*joint].rate)
                .any(|r| r.is_finite())
        })
        .collect();
    let mut columns: Vec<WheelColumns> = (spinning.iter())
        .map(|&(joint, ..)| WheelColumns {
            joint,
            along: Vec::with_capacity(view.bins),
            centre: Vec::with_capacity(view.bins),
            speed: Vec::with_capacity(view.bins),
        })
        .collect();
    let mut state = State::<f64>::zero(machine);
    let mut placed = RestingBodies::new(machine);
    for bin in 0..view.bins {
        view.set_joints(bin, &mut state);
        placed.place(machine, &state);
        for (columns, &(joint, wheel, body)) in columns.iter_mut().zip(&spinning) {
            let wheel = &machine.wheels()[wheel];
            // A wheel that turns about the axis a rolls along a x z.
            let axis = z_axis(&placed.motions[body].rotation);
            let along = axis.cross(&Vector3::z());
            let rate = view.joints[joint].measured_rate[bin];
            let rate = if rate.is_finite() {
                rate
            } else {
                view.joints[joint].rate[bin]
            };
            columns.along.push(
                along
                    .try_normalize(0.3)
                    .unwrap_or(Vector3::repeat(f64::NAN)),
            );
            columns
                .centre
                .push(placed.motions[wheel.body].point(&wheel.centre_in_body));
            columns.speed.push(rate * wheel.radius);
        }
    }
    columns
}

/// Velocity and yaw rate by the wheels, with t the rolling direction, p the centre and s the speed of each, in the
/// least-squares sense:
/// ```text
///     t . (v + w z x p) = s,      (z x t) . (v + w z x p) = 0
/// ```
fn twist(wheels: &[WheelColumns], bins: usize) -> (Vec<Vector3<f64>>, Vec<f64>) {
    let mut velocity = vec![Vector3::repeat(f64::NAN); bins];
    let mut yaw = vec![f64::NAN; bins];
    for bin in 0..bins {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for wheel in wheels.iter().filter(|wheel| wheel.speed[bin].is_finite()) {
            let (along, centre) = (wheel.along[bin], wheel.centre[bin]);
            let across = Vector3::z().cross(&along);
            for (direction, speed, weight) in [
                (along, wheel.speed[bin], 1.0),
                (across, 0.0, LATERAL_WEIGHT),
            ] {
                let turned = direction.y * centre.x - direction.x * centre.y;
                let row = Vector3::new(direction.x, direction.y, turned) * weight;
                normal += row * row.transpose();
                right += row * speed * weight;
            }
        }
        if let Some(inverse) = normal.try_inverse() {
            let found = inverse * right;
            velocity[bin] = Vector3::new(found.x, found.y, 0.0);
            yaw[bin] = found.z;
        }
    }
    (velocity, yaw)
}
