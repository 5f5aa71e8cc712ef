//! The motion of the platform: gyro against attitude, and specific force against both and the velocity.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::super::explanation::{Explanation, SpeedUnit};
use super::super::fault::Part;
use super::hypotheses::{Compared, Hypotheses};
use super::likelihood::{Mixture, Standing};
use super::window::Window;
use crate::machine::{Axis, Machine};

/// Gyro against attitude.
///
/// The up direction u of the attitude, in base axes, turns as the gyro says, with the rotation a over the window:
/// ```text
///     u1 = exp(-a) u0
/// ```
/// and the heading by `a . u`. Only inclinations are compared where the attitude has no heading that moves.
#[derive(Debug, Clone)]
pub(super) struct RotationRelation {
    inclination: Hypotheses,
    heading: Hypotheses,
    heading_moves: bool,
}

/// Multiple of the standard deviation of its noise from which a motion tests a sensor that would show none of it, or another.
const MOVES: f64 = 5.0;

/// The share of a motion that stands out of its noise, from 0 to 1. By noise alone a machine that rests agrees better with
/// every hypothesis of less motion, in each window a little.
fn share_of_motion(motion: &Vector3<f64>, noise: f64) -> f64 {
    let least = MOVES * noise;
    (1.0 - least * least / motion.norm_squared()).max(0.0)
}

/// Bias of a gyro (rad/s), and its change in a window (rad/s).
const GYRO_BIAS: f64 = 0.01;
const GYRO_BIAS_DRIFT: f64 = 2e-4;
/// Share of the rotation by which a gyro errs: scale, axes that are not square, lag of the attitude's own filter.
const ROTATION_SHARE: f64 = 0.04;
/// Lag of an attitude behind the gyro (s).
const ATTITUDE_LAG_S: f64 = 0.02;
/// Time in which an attitude follows a specific force that is not gravity (s): the shortest of usual filters.
const FOLLOWS_FORCE_S: f64 = 5.0;
/// Inclination that no filter of an attitude shows (rad).
const LEAST_ROTATION: f64 = 4e-4;
const ROTATIONS: Mixture = Mixture {
    outliers: 0.02,
    range: 0.5,
};
/// A compass near a steel arm errs by much (rad), and by a share of the turn.
const COMPASS: f64 = 0.05;
const COMPASS_SHARE: f64 = 0.3;
/// Rotation about the vertical below which a heading stands still (rad).
const NO_HEADING: f64 = 0.02;

impl RotationRelation {
    pub(super) fn new(threshold: f64) -> Self {
        let mut alternatives = Explanation::of_vectors();
        alternatives.extend([
            Explanation::Stopped,
            Explanation::Scale(true),
            Explanation::Scale(false),
        ]);
        let about_z = vec![Explanation::Sign(Axis::Z), Explanation::Stopped];
        Self {
            inclination: Hypotheses::new(ROTATIONS, GYRO_BIAS, alternatives, threshold),
            heading: Hypotheses::new(ROTATIONS, GYRO_BIAS, about_z, threshold),
            heading_moves: false,
        }
    }

    pub(super) fn weigh(&mut self, window: &Window) {
        let (Some(turned), Some([before, after])) = (window.turned, window.attitude) else {
            self.inclination.forget();
            self.heading.forget();
            return;
        };
        let up = |attitude: &UnitQuaternion<f64>| attitude.inverse_transform_vector(&Vector3::z());
        let (from, to) = (up(&before), up(&after));
        let lag = (window.turning[1] - window.turning[0]).norm() * ATTITUDE_LAG_S;
        let dragged = match (window.force, window.up) {
            (Some(force), Some(up)) => {
                let apart = force.cross(&up).norm() / force.norm().max(1.0);
                apart * window.duration_s / FOLLOWS_FORCE_S
            }
            _ => 0.0,
        };
        let noise = std::f64::consts::SQRT_2 * window.attitude_noise;
        let share = ROTATION_SHARE * turned.norm();
        let vibration = window.turned_noise;
        let sigma = [LEAST_ROTATION, noise, vibration, lag, dragged, share];
        let sigma = sigma.iter().map(|s| s * s).sum::<f64>().sqrt();
        let compared = |measured, sigma| Compared {
            start_ns: window.start_ns,
            measured,
            sigma,
            drift: GYRO_BIAS_DRIFT,
            per_offset: window.duration_s,
        };
        let moves = share_of_motion(&turned, vibration);
        let seen = |explanation: Option<Explanation>| {
            let matrix = explanation.and_then(Explanation::matrix);
            matrix.map_or(turned, |matrix| turned + (matrix * turned - turned) * moves)
        };
        let inclined = compared(to, Vector3::repeat(sigma));
        self.inclination.weigh(&inclined, |explanation| {
            UnitQuaternion::from_scaled_axis(-seen(explanation)) * from
        });
        let heading = (before.inverse() * after).scaled_axis().dot(&from);
        self.heading_moves |= heading.abs() > NO_HEADING;
        if self.heading_moves {
            let about = turned.dot(&from);
            let share = COMPASS_SHARE * about.abs().max(heading.abs());
            let sigma = Vector3::new(f64::INFINITY, f64::INFINITY, COMPASS.hypot(share));
            let turned = compared(Vector3::z() * heading, sigma);
            self.heading.weigh(&turned, |explanation| {
                let matrix = explanation.and_then(Explanation::matrix);
                Vector3::z() * about * matrix.map_or(1.0, |matrix| matrix[(2, 2)])
            });
        }
    }

    /// Whether an alternative about the inclination, with this prior probability, is now more likely than sound sensors. The
    /// heading does not count: a compass near a steel arm is wrong.
    pub(super) fn is_disputed(&self, beforehand: f64) -> bool {
        self.inclination.is_disputed(beforehand)
    }

    pub(super) fn standing(&self) -> Standing {
        self.inclination.standing().or(self.heading.standing())
    }

    /// Returns the evidence of the attitude against an alternative of the gyro about x and y, as a log likelihood ratio.
    pub(super) fn against(&self, explanation: Explanation) -> f64 {
        self.inclination.against(explanation)
    }
}

/// Specific force against attitude, gyro and velocity.
///
/// An accelerometer at p with the velocity `v + w x p`, in base axes, measures
/// ```text
///     f = dv/dt + w x v + g up
/// ```
/// on average over a window. The velocity is that of the odometry; without one, the wheels give its forward component. Up is that of
/// the attitude; without one, it is the specific force at rest, carried on by the gyro: see [`Inclination`](super::inclination::Inclination).
///
/// A housing that is turned turns the attitude and the gyro with the specific force, as M turns vectors: f, w and up agree with
/// each other, and with M v in place of v and M p in place of p.
#[derive(Debug, Clone)]
pub(super) struct SpecificForceRelation {
    gravity: f64,
    /// Position of the IMU (m, base axes).
    position: Vector3<f64>,
    by_odometry: Hypotheses,
    by_wheels: Hypotheses,
    uses_wheels: bool,
}

/// Constant difference between a sound accelerometer and a sound attitude, as a multiple of their stated standard deviations
/// together, and its change in a window (m/s^2).
const BIAS_SPREAD: f64 = 3.0;
const FORCE_BIAS_DRIFT: f64 = 0.01;
/// Mean specific force that has other causes (m/s^2).
const LEAST_FORCE: f64 = 0.08;
/// Noise of a velocity (m/s).
pub(super) const VELOCITY_NOISE: f64 = 0.01;
/// Share of the acceleration by which a velocity lags or slips.
const ACCELERATION_SHARE: f64 = 0.15;
/// Vertical component of the up direction of a machine that drives: a slope of 60 degrees.
const UPRIGHT: f64 = 0.5;
const FORCES: Mixture = Mixture {
    outliers: 0.05,
    range: 4.0,
};

impl SpecificForceRelation {
    pub(super) fn new(machine: &Machine, threshold: f64) -> Self {
        let turned = vec![
            Explanation::HalfTurn(Axis::Z),
            Explanation::HousingHalfTurn(Axis::Z),
        ];
        let mut of_odometry = Explanation::of_vectors();
        of_odometry.push(Explanation::GravityOnly);
        of_odometry.extend(SpeedUnit::ALL.map(Explanation::Speed));
        of_odometry.extend(Explanation::of_housings());
        let stated = machine.uncertainty();
        let tilt = stated.attitude_bias * machine.gravity();
        let bias = BIAS_SPREAD * stated.accelerometer_bias.hypot(tilt);
        Self {
            gravity: machine.gravity(),
            position: machine.imu().body_from_mount.translation.vector,
            by_odometry: Hypotheses::new(FORCES, bias, of_odometry, threshold),
            by_wheels: Hypotheses::new(FORCES, bias, turned, threshold),
            uses_wheels: false,
        }
    }

    /// Returns the part that the relation is about: comparison with the odometry, or with the wheels.
    pub(super) fn part(&self) -> Part {
        match self.uses_wheels {
            true => Part::Drive,
            false => Part::Acceleration,
        }
    }

    pub(super) fn weigh(&mut self, window: &Window) {
        let (Some(force), Some(up)) = (window.force, window.up) else {
            self.by_odometry.forget();
            self.by_wheels.forget();
            return;
        };
        let by_wheels = || {
            let [a, b] = window.rolled?;
            Some([a, b].map(|rolled| Vector3::x() * rolled.speed))
        };
        let Some(velocity) = window.velocity.or_else(by_wheels) else {
            return;
        };
        self.uses_wheels = window.velocity.is_none();
        let moved_by = |[of_velocity, of_position]: [Matrix3<f64>; 2]| {
            let position = of_position * self.position;
            let [before, after] = [0, 1].map(|end| {
                let turning = window.turning[end];
                of_velocity * velocity[end] + turning.cross(&position)
            });
            let turned = [(0, before), (1, after)].map(|(end, v)| window.turning[end].cross(&v));
            let gained = (after - before) / window.duration_s;
            (gained, gained + (turned[0] + turned[1]) / 2.0)
        };
        let (gained, moved) = moved_by([Matrix3::identity(); 2]);
        let slip = if self.uses_wheels {
            window.slip / window.duration_s
        } else {
            0.0
        };
        let velocity_noise = match self.uses_wheels {
            true => 2.0 * VELOCITY_NOISE,
            false => window.velocity_noise.max(2.0 * VELOCITY_NOISE),
        };
        let noise = velocity_noise / window.duration_s;
        let moves = share_of_motion(&moved, noise.max(slip));
        let tilt = self.gravity * window.carried.unwrap_or(0.0);
        let share = ACCELERATION_SHARE * gained.norm();
        let known = [LEAST_FORCE, noise, slip, share, tilt];
        let known = known.iter().map(|s| s * s).sum::<f64>();
        let mut sigma = window.force_scatter.map(|s| (s * s + known).sqrt());
        if self.uses_wheels {
            (sigma.y, sigma.z) = (f64::INFINITY, f64::INFINITY);
        }
        let compared = Compared {
            start_ns: window.start_ns,
            measured: force,
            sigma,
            drift: FORCE_BIAS_DRIFT,
            per_offset: 1.0,
        };
        let gravity = up * self.gravity;
        let hypotheses = match self.uses_wheels {
            true => &mut self.by_wheels,
            false => &mut self.by_odometry,
        };
        let sound = gravity + moved;
        hypotheses.weigh(&compared, |explanation| {
            let matrix = explanation.and_then(Explanation::matrix);
            let matrix = matrix.unwrap_or_else(Matrix3::identity);
            match explanation {
                None => sound,
                Some(Explanation::GravityOnly) => sound - moved * moves,
                Some(Explanation::Speed(unit)) => {
                    let shown = Matrix3::identity() * unit.in_si();
                    sound + (moved_by([shown, Matrix3::identity()]).1 - moved) * moves
                }
                Some(Explanation::HousingHalfTurn(_) | Explanation::HousingQuarterTurn(..)) => {
                    // no machine drives on its side or on its head
                    let stands = matrix.tr_mul(&up).z > UPRIGHT;
                    if stands {
                        gravity + moved_by([matrix; 2]).1
                    } else {
                        sound
                    }
                }
                // What it showed at rest is up, wrong or not, and not of a machine on its side.
                Some(_) if window.carried.is_some() => {
                    let stands = matrix.tr_mul(&up).z > UPRIGHT;
                    if stands {
                        gravity + matrix * moved
                    } else {
                        sound
                    }
                }
                Some(_) => matrix * sound,
            }
        });
    }

    /// Whether an alternative, with this prior probability, is now more likely than sound sensors, by the odometry or by the
    /// wheels: what one of both has shown holds while the other is used.
    pub(super) fn is_disputed(&self, beforehand: f64) -> bool {
        self.by_wheels.is_disputed(beforehand) || self.by_odometry.is_disputed(beforehand)
    }

    pub(super) fn standing(&self) -> Standing {
        match self.uses_wheels {
            true => self.by_wheels.standing(),
            false => self.by_odometry.standing(),
        }
    }
}
