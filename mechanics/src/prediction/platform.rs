//! The assumed motion of the platform.

use nalgebra::Vector3;

use super::instant::Instant;
use super::law::Law;
use crate::dynamics::kinematics::BodyMotion;
use crate::machine::{Machine, PredictionSpec};
use crate::state::BaseState;

/// Below this speed (m/s), its direction and the curve it follows are unknown: a velocity of this size is noise.
const SLOW: f64 = 0.2;

/// The present motion of the platform, split into what goes on and what dies away; all in base axes.
///
/// ```text
///     specific force = g up + u + w x v + r
/// ```
/// with the velocity v along the ground, its rate u along the ground, the angular velocity w, and the rest r, which the
/// platform does on its tyres. Without an attitude, slope and acceleration cannot be told apart: their sum stays as it is,
/// and only what the velocity shows changes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Platform {
    base: BodyMotion<f64>,
    gravity: f64,
    up: Option<Vector3<f64>>,
    velocity: Option<Vector3<f64>>,
    /// u, where it is known (m/s^2).
    rate: Vector3<f64>,
    /// r (m/s^2).
    rest: Vector3<f64>,
    /// Greatest deceleration of the brake (m/s^2) at this speed.
    brake: f64,
}

/// The motion of the platform at an instant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Course {
    pub(super) base: BodyMotion<f64>,
    /// Attitude and velocity.
    pub(super) known: BaseState<f64>,
    /// Speed as a fraction of the present one, and its time derivative (1/s); `None` if the present one is unknown or slow.
    pub(super) speed_ratio: Option<[f64; 2]>,
}

impl Platform {
    /// The present motion; `base` from the IMU, `known` with NaN where unknown.
    pub(super) fn new(machine: &Machine, base: BodyMotion<f64>, known: &BaseState<f64>) -> Self {
        let is_known = |v: &Vector3<f64>| v.iter().all(|c| c.is_finite());
        let up = Some(known.up).filter(is_known);
        let velocity = Some(along_ground(&known.velocity)).filter(is_known);
        let travel = velocity.unwrap_or_default();
        let w = &base.angular_velocity;
        let (rate, rest) = match up {
            Some(up) => {
                let moving = base.specific_force - up * machine.gravity - w.cross(&travel);
                let rate = along_ground(&moving);
                (rate, moving - rate)
            }
            None => {
                let rate = along_ground(&known.velocity_rate);
                let rate = Some(rate).filter(|rate| velocity.is_some() && is_known(rate));
                (rate.unwrap_or_default(), Vector3::zeros())
            }
        };
        let spec = &machine.prediction;
        let speed = travel.norm();
        let slows = if speed > 0.0 {
            -rate.dot(&travel) / speed
        } else {
            0.0
        };
        Self {
            base,
            gravity: machine.gravity,
            up,
            velocity,
            rate,
            rest,
            brake: spec
                .brake_deceleration
                .max(slows)
                .min(speed / spec.stop_time),
        }
    }

    pub(super) fn has_velocity(&self) -> bool {
        self.velocity.is_some()
    }

    /// The motion at an instant.
    pub(super) fn at(&self, law: Law, instant: &Instant) -> Course {
        let (travel, rate) = self.travel(law, instant);
        let now = self.velocity.unwrap_or_default();
        let speed = now.norm();
        let speed_ratio = (self.velocity.is_some() && speed >= SLOW).then(|| {
            let along = now / speed;
            [travel.norm() / speed, rate.dot(&along) / speed]
        });
        let [ratio, ratio_rate] = speed_ratio.unwrap_or([1.0, 0.0]);
        let (w, alpha) = (&self.base.angular_velocity, &self.base.angular_acceleration);
        // The curve stays: the yaw rate is in proportion to the speed.
        let yaw = w.z + alpha.z * instant.joint.i;
        let angular_velocity =
            Vector3::new(w.x * instant.shake.e, w.y * instant.shake.e, yaw * ratio);
        let angular_acceleration = Vector3::new(
            alpha.x * instant.shake.e,
            alpha.y * instant.shake.e,
            alpha.z * instant.joint.e * ratio + yaw * ratio_rate,
        );
        let turned = Vector3::new(
            w.x * instant.shake.i,
            w.y * instant.shake.i,
            0.5 * instant.time_s * (w.z + angular_velocity.z),
        );
        let up = self.up.map(|up| turned_back(&up, &turned));
        let transport = angular_velocity.cross(&travel);
        let specific_force = match up {
            Some(up) => up * self.gravity + rate + transport + self.rest * instant.shake.e,
            None => {
                let change = rate - self.rate + transport - w.cross(&now);
                self.base.specific_force + change
            }
        };
        let unknown = Vector3::repeat(f64::NAN);
        Course {
            base: BodyMotion::base(specific_force, angular_velocity, angular_acceleration),
            known: BaseState {
                up: up.unwrap_or(unknown),
                velocity: self.velocity.map_or(unknown, |_| travel),
                velocity_rate: self.velocity.map_or(unknown, |_| rate),
            },
            speed_ratio,
        }
    }

    /// Velocity along the ground and its rate. A platform that slows down comes to rest and does not turn back.
    fn travel(&self, law: Law, instant: &Instant) -> (Vector3<f64>, Vector3<f64>) {
        let at_rest = (Vector3::zeros(), Vector3::zeros());
        let Some(now) = self.velocity else {
            return (Vector3::zeros(), self.rate * instant.platform.e);
        };
        let speed = now.norm();
        if law == Law::BrakeNow && speed > 0.0 {
            let left = speed - self.brake * instant.time_s;
            let along = now / speed;
            return match left > 0.0 {
                true => (along * left, along * -self.brake),
                false => at_rest,
            };
        }
        let then = now + self.rate * instant.platform.i;
        if self.rate.dot(&now) < 0.0 && then.dot(&now) <= 0.0 {
            return at_rest;
        }
        (then, self.rate * instant.platform.e)
    }
}

impl PredictionSpec {
    /// The instants of a prediction (s), closer together at first: `t_k = horizon (k / points)^2`.
    pub(super) fn times_s(&self) -> impl Iterator<Item = f64> + '_ {
        (1..=self.points).map(|k| self.horizon * (k as f64 / self.points as f64).powi(2))
    }
}

fn along_ground(v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.x, v.y, 0.0)
}

/// A fixed direction as seen from axes that have turned by this rotation vector (Rodrigues).
fn turned_back(direction: &Vector3<f64>, turned: &Vector3<f64>) -> Vector3<f64> {
    let angle = turned.norm();
    if angle == 0.0 {
        return *direction;
    }
    let axis = -turned / angle;
    let (sin, cos) = angle.sin_cos();
    direction * cos + axis.cross(direction) * sin + axis * (axis.dot(direction) * (1.0 - cos))
}
