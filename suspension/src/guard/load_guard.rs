//! The load guard: restrains a wanted motion of the rods to what every wheel can afford.
//!
//! The loads of locked rods are the measure. D = N - N_lock is what the suspension adds to a wheel. Where it takes
//! something, it may take only a share of what that wheel has above the limit, now and in the near future, S(13):
//! ```text
//!     S(14)  at a stroke to stay at   D(x)            >= -k_x max(0, min over T_x of N_lock - limit)
//!            during a motion          D(x) + c A a    >= -max(k_a max(0, min over T_a of N_lock - limit), e)
//! ```
//! and likewise for the stability angles at a stroke to stay at, with the smallest angle that locking has given so far
//! as the limit, or an ample one if that is smaller. So a load is never below the smaller of the limit and what locking gives, e aside. A is the immediate effect of
//! the rods' own acceleration, and c its overshoot in the hydraulics. Every motion is checked with the braking that
//! ends it: now, at the end of the step, where the rods brake, and where they come to rest.
//!
//! ```text
//!     S(15)  a = 6 (p - x)/H^2 - 4 xd/H,   H >= 2.45 T*,   |da/dt| <= A/0.2 s
//! ```
//! leads to the stroke p. With this H the inertia of the start takes no more than the move will give, S(8).

use super::response::{ByWheel, Response, ResponseFinder};
use crate::condensed::{MAX_ACTUATORS, SuspendedMachine};
use crate::problem::{RodLimits, clamp};
use tipwatch_mechanics::machine::{MAX_WHEELS, Machine};
use tipwatch_mechanics::state::State;

/// Default limit of a wheel's load, as a share of the mean load.
const DEFAULT_LIMIT_SHARE: f64 = 0.05;
/// k_x and T_x (s) of S(14): rods need about so long to return.
const POSITION_SHARE: f64 = 0.2;
const POSITION_AHEAD_S: f64 = 1.0;
/// The same for angles, whose loss is no danger in itself.
const ANGLE_SHARE: f64 = 0.5;
const ANGLE_AHEAD_S: f64 = 0.5;
/// k_a and T_a (s): a commanded acceleration ends within this time.
const MOTION_SHARE: f64 = 0.5;
const MOTION_AHEAD_S: f64 = 0.3;
/// e, as a share of the mean load: what a wheel that is light anyway may lose for a moment.
const TOLERANCE_SHARE: f64 = 0.002;
/// What the spread of the loads may grow by for a moment, as a share of the weight.
const SPREAD_SHARE: f64 = 0.01;
/// A load below its bound counts for more than any spread or angle (in units of the mean load).
const PRIORITY: f64 = 1e3;
/// c: overshoot of the rods' acceleration in the hydraulics.
const OVERSHOOT: f64 = 1.3;
/// A stability angle above which the loads come first (rad): to keep more would cost wheels that can be held down.
const AMPLE_ANGLE: f64 = 0.25;
/// Weight of a radian in units of the mean load.
const ANGLE_UNIT: f64 = 2.0;
/// H over T*: a start then takes from a wheel at most what the whole move gives it.
const HORIZON_FACTOR: f64 = 2.45;
/// The longest H (s).
const MAX_HORIZON_S: f64 = 3.0;
/// Time to reach the largest acceleration (s).
const ACCELERATION_RISE_S: f64 = 0.2;
/// The hardest braking at the end of a motion, as a share of the largest acceleration.
const BRAKING_SHARE: f64 = 0.3;
/// The gentlest, as a share of the hardest.
const LEAST_BRAKING_SHARE: f64 = 0.1;
/// Halvings in the search for the largest safe share of a motion.
const HALVINGS: usize = 8;

/// The wanted motion.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Move {
    /// To these strokes (m), to rest there.
    To([f64; MAX_ACTUATORS]),
    /// To rest where that is soonest.
    Stop,
}

/// The restrained motion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Guarded {
    /// By rod (m/s^2).
    pub(crate) acceleration: [f64; MAX_ACTUATORS],
    /// Whether it is less than the wanted one.
    pub(crate) is_restrained: bool,
}

/// Position and velocity of the rods.
type Rods = [[f64; MAX_ACTUATORS]; 2];

/// Guards the wheel loads. A step does not allocate and its work is fixed.
#[derive(Debug)]
pub(crate) struct LoadGuard {
    finder: ResponseFinder,
    limits: RodLimits,
    actuators: usize,
    /// Time in which a move comes to rest (s).
    look_ahead: f64,
    mean_load: f64,
    limit: f64,
    min_angle: f64,
    /// Strokes where control began (m), the measure of what locking gives.
    home: Option<[f64; MAX_ACTUATORS]>,
    /// The smallest stability angle that locking has given since then (rad).
    least_locked_angle: f64,
    /// The largest load spread that locking has given since then (N).
    most_locked_spread: f64,
    /// The last acceleration (m/s^2).
    last: [f64; MAX_ACTUATORS],
}

impl LoadGuard {
    pub(crate) fn new(
        suspended: &SuspendedMachine,
        limits: RodLimits,
        look_ahead: f64,
        min_angle: f64,
    ) -> Self {
        let machine: &Machine = &suspended.machine;
        let mean_load = machine.mass() * machine.gravity() / machine.wheels().len() as f64;
        let stated = machine.limits();
        let share = stated.min_load_share.unwrap_or(DEFAULT_LIMIT_SHARE);
        Self {
            finder: ResponseFinder::new(suspended),
            limits,
            actuators: suspended.linkages.len(),
            look_ahead,
            mean_load,
            limit: stated.min_load.unwrap_or(share * mean_load),
            min_angle,
            home: None,
            least_locked_angle: f64::INFINITY,
            most_locked_spread: 0.0,
            last: [0.0; MAX_ACTUATORS],
        }
    }

    /// Discards the history: control begins anew.
    pub(crate) fn reset(&mut self) {
        self.home = None;
        self.least_locked_angle = f64::INFINITY;
        self.most_locked_spread = 0.0;
        self.last = [0.0; MAX_ACTUATORS];
    }

    /// The rods have moved on without the guard, with this acceleration (m/s^2).
    pub(crate) fn overruled(&mut self, acceleration: [f64; MAX_ACTUATORS]) {
        self.last = acceleration;
    }

    /// Restrains a motion of rods at the strokes `x` (m) with velocities `v` (m/s), all within their limits;
    /// `None` if the loads cannot be computed.
    pub(crate) fn restrain(
        &mut self,
        state: &State<f64>,
        x: &[f64],
        v: &[f64],
        wanted: Move,
    ) -> Option<Guarded> {
        let (mut rods, mut home): (Rods, _) = ([[0.0; MAX_ACTUATORS]; 2], [0.0; MAX_ACTUATORS]);
        for k in 0..self.actuators {
            (rods[0][k], rods[1][k]) = (x[k], v[k]);
            home[k] = x[k];
        }
        let home = *self.home.get_or_insert(home);
        let response = self.finder.find(state, x, v, &home);
        if !response.is_known() {
            return None;
        }
        let angles = &response.locked_angle[..response.edges];
        let least_angle = angles.iter().copied().fold(f64::INFINITY, f64::min);
        self.least_locked_angle = self.least_locked_angle.min(least_angle);
        let locked_spread = spread(&response.locked[..response.wheels]);
        self.most_locked_spread = self.most_locked_spread.max(locked_spread);
        let check = Check::of(self, &response, rods);
        let braking = check.braking(&rods[1]);
        let wanted = match wanted {
            Move::To(target) => check.towards(&check.nearest_affordable(&home, &target)),
            Move::Stop => braking,
        };
        let wanted = self.within_limits(&rods, wanted);
        let acceleration = self.affordable(&check, &rods, wanted, braking);
        self.last = acceleration;
        Some(Guarded {
            acceleration,
            is_restrained: acceleration != wanted,
        })
    }

    /// The wanted acceleration, else the largest affordable part of it beyond the best of coasting and braking.
    fn affordable(
        &self,
        check: &Check<'_>,
        rods: &Rods,
        wanted: [f64; MAX_ACTUATORS],
        braking: [f64; MAX_ACTUATORS],
    ) -> [f64; MAX_ACTUATORS] {
        let margin = |a: &[f64; MAX_ACTUATORS]| check.margin(a);
        let wanted_margin = margin(&wanted);
        if wanted_margin >= 0.0 {
            return wanted;
        }
        let resting = [[0.0; MAX_ACTUATORS], braking].map(|a| self.within_limits(rods, a));
        let margins = resting.map(|a| margin(&a));
        let best = usize::from(margins[1] > margins[0]);
        let (mut safe, safe_margin) = (resting[best], margins[best]);
        if safe_margin < 0.0 {
            // nothing is affordable: what costs least
            return if wanted_margin > safe_margin {
                wanted
            } else {
                safe
            };
        }
        let mut unsafe_one = wanted;
        for _ in 0..HALVINGS {
            let middle = std::array::from_fn(|k| 0.5 * (safe[k] + unsafe_one[k]));
            if margin(&middle) >= 0.0 {
                safe = middle;
            } else {
                unsafe_one = middle;
            }
        }
        safe
    }

    /// An acceleration within the rods' limits that changes no faster than it may; rods that move alike keep to it.
    fn within_limits(
        &self,
        rods: &Rods,
        mut acceleration: [f64; MAX_ACTUATORS],
    ) -> [f64; MAX_ACTUATORS] {
        let reach =
            self.limits.max_acceleration * (self.limits.step / ACCELERATION_RISE_S).min(2.0);
        for (k, a) in acceleration[..self.actuators].iter_mut().enumerate() {
            let slow = clamp(*a, [self.last[k] - reach, self.last[k] + reach]);
            *a = clamp(slow, self.limits.allowed(rods[0][k], rods[1][k]).range);
        }
        acceleration
    }
}

/// S(14) at one instant.
struct Check<'a> {
    guard: &'a LoadGuard,
    response: &'a Response,
    rods: Rods,
    /// What each wheel may lose at a stroke, and during a motion (N).
    at_rest: ByWheel,
    in_motion: ByWheel,
    /// What each stability angle may lose at a stroke (rad).
    angle_at_rest: ByWheel,
    /// The largest spread allowed (N).
    max_spread: f64,
    horizon: f64,
}

/// Sum of the load differences over all pairs of wheels (N).
fn spread(loads: &[f64]) -> f64 {
    let mut sum = 0.0;
    for (i, a) in loads.iter().enumerate() {
        sum += loads[..i].iter().map(|b| (a - b).abs()).sum::<f64>();
    }
    sum
}

impl<'a> Check<'a> {
    fn of(guard: &'a LoadGuard, response: &'a Response, rods: Rods) -> Self {
        let spare = |wheel: usize, seconds: f64| {
            (response.least_locked(wheel, seconds) - guard.limit).max(0.0)
        };
        let tolerance = TOLERANCE_SHARE * guard.mean_load;
        let mut check = Self {
            guard,
            response,
            rods,
            at_rest: [0.0; MAX_WHEELS],
            in_motion: [0.0; MAX_WHEELS],
            angle_at_rest: [0.0; MAX_WHEELS],
            max_spread: guard.most_locked_spread.max(
                spread(&response.locked[..response.wheels])
                    + SPREAD_SHARE * guard.mean_load * response.wheels as f64,
            ),
            horizon: 0.0,
        };
        for wheel in 0..response.wheels {
            check.at_rest[wheel] = POSITION_SHARE * spare(wheel, POSITION_AHEAD_S);
            let moving = MOTION_SHARE * spare(wheel, MOTION_AHEAD_S);
            check.in_motion[wheel] = moving.max(tolerance);
        }
        let ample = AMPLE_ANGLE
            .min(guard.least_locked_angle)
            .max(guard.min_angle);
        for edge in 0..response.edges {
            let spare = response.least_locked_angle(edge, ANGLE_AHEAD_S) - ample;
            check.angle_at_rest[edge] = ANGLE_SHARE * spare.max(0.0);
        }
        check.horizon = (HORIZON_FACTOR * check.critical_time())
            .max(guard.look_ahead)
            .min(MAX_HORIZON_S.max(guard.look_ahead));
        check
    }

    /// T*, all load differences weighted alike: S(8).
    fn critical_time(&self) -> f64 {
        let (mut mixed, mut plain) = (0.0, 0.0);
        let response = self.response;
        for k in 0..self.guard.actuators {
            for wheel in 0..response.wheels {
                let x = response.by_position[k][wheel];
                mixed -= x * response.by_acceleration[k][wheel];
                plain += x * x;
            }
        }
        let square = mixed / plain;
        if square > 0.0 { square.sqrt() } else { 0.0 }
    }

    /// S(15)
    fn towards(&self, target: &[f64; MAX_ACTUATORS]) -> [f64; MAX_ACTUATORS] {
        let [x, v] = self.rods;
        let h = self.horizon;
        std::array::from_fn(|k| 6.0 * (target[k] - x[k]) / (h * h) - 4.0 * v[k] / h)
    }

    /// Braking from these velocities in common, as hard as every wheel can afford: what it takes, at a step of the
    /// largest braking, is in proportion to it.
    fn braking(&self, v: &[f64; MAX_ACTUATORS]) -> [f64; MAX_ACTUATORS] {
        let (limits, response) = (&self.guard.limits, self.response);
        let fastest = v.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        if fastest == 0.0 {
            return [0.0; MAX_ACTUATORS];
        }
        let most = BRAKING_SHARE * limits.max_acceleration;
        let hardest = v.map(|v| -most * v / fastest);
        let mut share = 1.0_f64;
        let mut braked = response.load;
        for wheel in 0..response.wheels {
            let (mut taken, mut spare) = (0.0, self.in_motion[wheel]);
            spare += response.load[wheel] - response.locked[wheel];
            for k in 0..self.guard.actuators {
                taken -= OVERSHOOT * response.by_acceleration[k][wheel] * hardest[k];
            }
            if taken > 0.0 {
                share = share.min(spare / taken);
            }
            braked[wheel] -= taken;
        }
        let [now, braked] = [response.load, braked].map(|loads| spread(&loads[..response.wheels]));
        if braked > now {
            // the spread is convex
            share = share.min((self.max_spread - now) / (braked - now));
        }
        let share = share.max(LEAST_BRAKING_SHARE);
        // no further than to rest within the step
        let share = share.min(fastest / (limits.step * most));
        hardest.map(|a| share * a)
    }

    /// The strokes on the way from home to a target that are as near to it as every wheel can afford.
    fn nearest_affordable(
        &self,
        home: &[f64; MAX_ACTUATORS],
        target: &[f64; MAX_ACTUATORS],
    ) -> [f64; MAX_ACTUATORS] {
        let at = |share: f64| -> [f64; MAX_ACTUATORS] {
            std::array::from_fn(|k| home[k] + share * (target[k] - home[k]))
        };
        if self.rest_margin(&at(1.0)) >= 0.0 {
            return at(1.0);
        }
        let (mut safe, mut unsafe_one) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (safe + unsafe_one);
            if self.rest_margin(&at(middle)) >= 0.0 {
                safe = middle;
            } else {
                unsafe_one = middle;
            }
        }
        at(safe)
    }

    /// The least margin of a motion with this acceleration in the next step, followed by braking (N).
    fn margin(&self, acceleration: &[f64; MAX_ACTUATORS]) -> f64 {
        let (limits, [x, v]) = (&self.guard.limits, &self.rods);
        let dt = limits.step;
        let (mut end, mut velocity) = (*x, *v);
        for k in 0..self.guard.actuators {
            velocity[k] = v[k] + dt * acceleration[k];
            end[k] = x[k] + dt * velocity[k];
        }
        let braking = self.braking(&velocity);
        let mut rest = end;
        for k in 0..self.guard.actuators {
            if braking[k] != 0.0 {
                rest[k] = end[k] - 0.5 * velocity[k] * velocity[k] / braking[k];
            }
        }
        self.moving_margin(x, acceleration)
            .min(self.moving_margin(&end, &braking))
            .min(self.rest_margin(&rest))
    }

    /// What rods at `x` with an acceleration leave of what wheels may lose.
    fn moving_margin(&self, x: &[f64; MAX_ACTUATORS], a: &[f64; MAX_ACTUATORS]) -> f64 {
        self.least_margin(x, a, &self.in_motion)
    }

    /// The same for rods that stay at `x`, stability angles included.
    fn rest_margin(&self, x: &[f64; MAX_ACTUATORS]) -> f64 {
        let (response, unit) = (self.response, ANGLE_UNIT * self.guard.mean_load);
        let mut least = self.least_margin(x, &[0.0; MAX_ACTUATORS], &self.at_rest);
        for edge in 0..response.edges {
            let mut angle = response.angle[edge];
            for k in 0..self.guard.actuators {
                angle += response.angle_by_position[k][edge] * (x[k] - self.rods[0][k]);
            }
            let lost = response.locked_angle[edge] - angle;
            // unknown angles restrain nothing
            least = least.min(unit * (self.angle_at_rest[edge] - lost));
        }
        least
    }

    fn least_margin(
        &self,
        x: &[f64; MAX_ACTUATORS],
        a: &[f64; MAX_ACTUATORS],
        may_lose: &ByWheel,
    ) -> f64 {
        let response = self.response;
        let (mut least, mut load) = (f64::INFINITY, response.load);
        for (wheel, load) in load[..response.wheels].iter_mut().enumerate() {
            for k in 0..self.guard.actuators {
                *load += response.by_position[k][wheel] * (x[k] - self.rods[0][k])
                    + OVERSHOOT * response.by_acceleration[k][wheel] * a[k];
            }
            least = least.min(*load - response.locked[wheel] + may_lose[wheel]);
        }
        if least < 0.0 {
            return least - PRIORITY * self.guard.mean_load;
        }
        let wheels = response.wheels;
        let spare = self.max_spread - spread(&load[..wheels]);
        // a load moved from one wheel to another changes its difference to all others
        least.min(spare / (2 * wheels.max(2) - 2) as f64)
    }
}
