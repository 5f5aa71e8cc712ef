//! Limits of the rods' motion that prevent impacts on the stops: (31b-d).
//!
//! With the distances up = x_max - x and down = x - x_min to the stops, V and A the largest velocity and
//! acceleration, and u(z) = 2/pi atan(z):
//! ```text
//!     S(5)   v_max(x) =  V u(up / eps)                          v_min(x) = -V u(down / eps)
//!            a_max(x) =  A (rho + (1 - rho) u(up / eps))        a_min(x) = -A (rho + (1 - rho) u(down / eps))
//! ```
//! The limits towards a stop shrink as the rod approaches it; braking keeps nearly all of A. With (31e), (31f)
//! eliminated, (31b-d) leave an interval for the acceleration of each rod. Once this interval is not empty it
//! remains so, and no stop is passed, if
//! ```text
//!     S(6)   eps >= max( G V^2 / A_b,  2/pi V dt ),   G = 0.2327,   A_b = A (rho + (1 - rho) u(s / (2 eps)))
//! ```
//! Then v_max falls along x by no more per step than braking can follow (A_b is the braking acceleration in the
//! half of the stroke next to the stop, and G the maximum of (u(z) - u(z - alpha u(z))) / alpha over z and all
//! alpha = V dt / eps up to pi/2), and x + dt v_max(x) <= x_max.

use std::f64::consts::FRAC_2_PI;

use tipwatch_mechanics::machine::Suspension;
use tipwatch_mechanics::number::Real;

/// G of S(6).
const STEEPEST: f64 = 0.2327;
/// Fixed-point iterations for the zone of S(6), on which A_b depends with decreasing effect.
const ROUNDS: usize = 60;

/// The limits of one rod for a given time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RodLimits {
    /// x_min, x_max (m).
    pub(crate) stroke: [f64; 2],
    /// V (m/s).
    pub(crate) max_velocity: f64,
    /// A (m/s^2).
    pub(crate) max_acceleration: f64,
    /// rho.
    pub(crate) at_stop: f64,
    /// eps (m).
    pub(crate) zone: f64,
    /// dt (s).
    pub(crate) step: f64,
}

/// The accelerations allowed in the next step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Allowed {
    /// Smallest and largest (m/s^2).
    pub(crate) range: [f64; 2],
    /// Whether (31b-d) can all be met; otherwise the range is a single value, the best possible braking.
    pub(crate) viable: bool,
}

impl RodLimits {
    pub(crate) fn of(suspension: &Suspension, step: f64) -> Self {
        let (v, a) = (suspension.max_velocity, suspension.max_acceleration);
        let rho = suspension.control.acceleration_at_stop;
        let half = 0.5 * (suspension.stroke[1] - suspension.stroke[0]);
        let by_step = FRAC_2_PI * v * step;
        let mut zone = by_step;
        for _ in 0..ROUNDS {
            let braking = a * (rho + (1.0 - rho) * u(half / zone));
            zone = (STEEPEST * v * v / braking).max(by_step);
        }
        Self {
            stroke: suspension.stroke,
            max_velocity: v,
            max_acceleration: a,
            at_stop: rho,
            zone: zone * suspension.control.approach_margin,
            step,
        }
    }

    /// v_min, v_max of S(5).
    pub(crate) fn velocity(&self, x: f64) -> [f64; 2] {
        let [down, up] = self.nearness(x);
        [-self.max_velocity * down, self.max_velocity * up]
    }

    /// a_min, a_max of S(5).
    pub(crate) fn acceleration(&self, x: f64) -> [f64; 2] {
        let share = |near: f64| self.at_stop + (1.0 - self.at_stop) * near;
        let [down, up] = self.nearness(x).map(share);
        [-self.max_acceleration * down, self.max_acceleration * up]
    }

    /// u of the distances to the stops; negative beyond a stop.
    fn nearness(&self, x: f64) -> [f64; 2] {
        let [least, greatest] = self.stroke;
        [u((x - least) / self.zone), u((greatest - x) / self.zone)]
    }

    /// The accelerations that (31b-f) allow at position x and velocity v, both finite.
    pub(crate) fn allowed(&self, x: f64, v: f64) -> Allowed {
        let dt = self.step;
        let by_velocity = self.velocity(x).map(|limit| (limit - v) / dt);
        let by_stroke = self.stroke.map(|limit| (limit - x - dt * v) / (dt * dt));
        let by_acceleration = self.acceleration(x);
        let range = [
            by_velocity[0].max(by_stroke[0]).max(by_acceleration[0]),
            by_velocity[1].min(by_stroke[1]).min(by_acceleration[1]),
        ];
        if range[0] <= range[1] {
            return Allowed {
                range,
                viable: true,
            };
        }
        // Priority: braking, then the stops, then the velocity.
        let wanted = clamp(clamp(0.0, by_velocity), by_stroke);
        let best = clamp(wanted, self.hard(by_acceleration));
        Allowed {
            range: [best, best],
            viable: false,
        }
    }

    /// Acceleration limits of a rod beyond a stop, where those of S(5) may be inverted.
    fn hard(&self, by_acceleration: [f64; 2]) -> [f64; 2] {
        let a = self.max_acceleration;
        [
            by_acceleration[0].clamp(-a, 0.0),
            by_acceleration[1].clamp(0.0, a),
        ]
    }
}

/// The value in the range closest to the given one; the upper end if the range is empty.
pub(crate) fn clamp(value: f64, [least, greatest]: [f64; 2]) -> f64 {
    value.max(least).min(greatest)
}

/// u(z) = 2/pi atan(z), from operations that give the same bits on every platform.
fn u(z: f64) -> f64 {
    Real::atan2(z, 1.0) * FRAC_2_PI
}
