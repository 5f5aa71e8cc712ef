//! The load guard: restrains a wanted motion of the rods to what every wheel can afford.
//!
//! The loads of locked rods are the measure. A motion is admitted only if a return to where control began can still
//! follow it, S(16), that costs no wheel more than it can afford on the whole way, S(17). The return that was found is
//! there again at the next step, and ends where locked rods are. So the rods never go where only luck brings them back
//! from.
//!
//! ```text
//!     S(15)  a = 6 (p - x)/H^2 - 4 xd/H,   |a| <= 0.3 A_max,   |da/dt| <= J
//!     S(20)  c |A| J T/(2 pi) <= what each wheel, and the spread, may lose after T,
//!            0.3 A_max/T <= J <= A_max/T,   T = 0.5 s
//! ```
//! leads to the stroke p. What of it is not admitted is taken away by bisection towards the best return. If none is left,
//! because something moved more than S(14) reserves for, the plan that costs least is followed.
//!
//! A platform on tyres and oil swings back. Rods that brake unload one side for as long as they do, and the other side when
//! they stop braking: a change within half a swing takes from the wheels what it gave them before. S(20) is what the ramp
//! of an acceleration leaves behind as a swing. Where the wheels cannot afford it, the acceleration changes within a whole
//! swing T, whether it starts a motion, ends or brakes it. Without a return the rods are quicker, 1 + missing/m times with
//! m of S(17): a return that is missed by next to nothing is no reason to shake a platform on its light wheels.

use super::forecast::{ByRod, Forecaster};
use super::margin::{Bounds, Margins};
use super::plan::{Plan, Rods};
use crate::condensed::{MAX_ACTUATORS, SuspendedMachine};
use crate::problem::{RodLimits, clamp};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::{ImuState, State};

/// Default limit of a wheel's load, as a share of the mean load.
const DEFAULT_LIMIT_SHARE: f64 = 0.05;
/// A stability angle above which the loads come first (rad): to keep more would cost wheels that can be held down.
const AMPLE_ANGLE: f64 = 0.25;
/// b_q of S(14): the largest acceleration of the joint so far, at least this (rad/s^2 or m/s^2).
const ARM_RESERVE: f64 = 0.2;
/// Time in which an acceleration that was seen is forgotten (s).
const FORGET_S: f64 = 30.0;
/// Time in which an acceleration rises to its largest (s): as long as a swing of the platform on tyres and oil, so as not
/// to start one.
const ACCELERATION_RISE_S: f64 = 0.5;
/// The largest acceleration of S(15), as a share of the rods' largest: harder motions set the platform swinging on its tyres.
const WANTED_SHARE: f64 = 0.3;
/// Halvings in the search for the largest safe share of a motion.
const HALVINGS: usize = 6;

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
    /// Acceleration by rod (m/s^2).
    pub(crate) acceleration: [f64; MAX_ACTUATORS],
    /// Whether the motion is less than the wanted one.
    pub(crate) is_restrained: bool,
}

/// Guards the wheel loads. A step does not allocate and its work is fixed.
#[derive(Debug)]
pub(crate) struct LoadGuard {
    forecaster: Forecaster,
    margins: Margins,
    limits: RodLimits,
    actuators: usize,
    /// (m/s)
    max_velocity: f64,
    /// H of S(15) (s).
    look_ahead: f64,
    /// Bounds that do not change.
    bounds: Bounds,
    min_angle: f64,
    history: History,
}

/// Record of the motion since control began.
#[derive(Debug)]
struct History {
    /// Strokes when control began (m): the loads of rods locked there are the measure.
    home: Option<ByRod>,
    /// Largest acceleration of each joint of the arm (rad/s^2 or m/s^2).
    arm: Vec<f64>,
    /// b_q of S(14).
    arm_reserve: Vec<f64>,
    /// The last acceleration of the rods (m/s^2).
    last: ByRod,
}

impl LoadGuard {
    pub(crate) fn new(
        suspended: &SuspendedMachine,
        limits: RodLimits,
        look_ahead: f64,
        min_angle: f64,
    ) -> Self {
        let machine: &Machine = &suspended.machine;
        let weight = machine.mass() * machine.gravity();
        let mean_load = weight / machine.wheels().len() as f64;
        let stated = machine.limits();
        let share = stated.min_load_share.unwrap_or(DEFAULT_LIMIT_SHARE);
        let bounds = Bounds {
            mean_load,
            limit: stated.min_load.unwrap_or(share * mean_load),
            angle: min_angle,
            weight,
            acceleration: limits.max_acceleration,
        };
        let forecaster = Forecaster::new(suspended);
        Self {
            history: History::new(forecaster.arm().len()),
            forecaster,
            margins: Margins::new(bounds),
            max_velocity: limits.max_velocity,
            limits,
            actuators: suspended.linkages.len(),
            look_ahead,
            bounds,
            min_angle,
        }
    }

    /// Discards the history: control begins anew. How the machine moves is remembered.
    pub(crate) fn reset(&mut self) {
        self.history.reset();
    }

    /// The rods have moved on without the guard, with this acceleration (m/s^2).
    pub(crate) fn overruled(&mut self, acceleration: [f64; MAX_ACTUATORS]) {
        self.history.last = acceleration;
    }

    /// Takes the state of a step and returns the mean motion of the ground, which guides the rods.
    pub(crate) fn observe(&mut self, state: &State<f64>, x: &[f64], v: &[f64]) -> ImuState<f64> {
        let rods = self.rods(x, v);
        let home = *self.history.home.get_or_insert(rods.x);
        self.history
            .see_arm(state, self.forecaster.arm(), self.limits.step);
        self.forecaster
            .observe(state, [&rods.x, &rods.v], &home, self.limits.step)
    }

    fn rods(&self, x: &[f64], v: &[f64]) -> Rods {
        let mut rods = Rods {
            x: [0.0; MAX_ACTUATORS],
            v: [0.0; MAX_ACTUATORS],
        };
        for k in 0..self.actuators {
            (rods.x[k], rods.v[k]) = (x[k], v[k]);
        }
        rods
    }

    /// Restrains a motion of rods at the strokes `x` (m) with velocities `v` (m/s), all within their limits, to no more
    /// than a velocity (m/s); `None` if the loads cannot be computed.
    pub(crate) fn restrain(
        &mut self,
        state: &State<f64>,
        x: &[f64],
        v: &[f64],
        wanted: Move,
        max_velocity: f64,
    ) -> Option<Guarded> {
        self.max_velocity = max_velocity;
        let rods = self.rods(x, v);
        let home = *self.history.home.get_or_insert(rods.x);
        let forecast = self
            .forecaster
            .find(state, &rods.x, &home, &self.history.arm_reserve);
        if !forecast.is_known() {
            return None;
        }
        let bounds = Bounds {
            angle: AMPLE_ANGLE
                .min(forecast.least_locked_angle())
                .max(self.min_angle),
            ..self.bounds
        };
        self.margins.take(&forecast, rods, home, bounds);
        let wanted = match wanted {
            Move::To(target) => self.towards(&rods, &target),
            Move::Stop => self.margins.start(Plan::STOP, &rods),
        };
        let jerk = self.jerk();
        let wanted = self.within_limits(&rods, wanted, jerk);
        let acceleration = self.affordable(&rods, wanted, jerk);
        self.history.last = acceleration;
        Some(Guarded {
            acceleration,
            is_restrained: acceleration != wanted,
        })
    }

    /// S(15)
    fn towards(&self, rods: &Rods, target: &ByRod) -> ByRod {
        let h = self.look_ahead;
        let wanted: ByRod =
            std::array::from_fn(|k| 6.0 * (target[k] - rods.x[k]) / (h * h) - 4.0 * rods.v[k] / h);
        // rods that move alike keep to it
        let hardest = wanted.iter().fold(0.0_f64, |most, a| most.max(a.abs()));
        let most = WANTED_SHARE * self.limits.max_acceleration;
        wanted.map(|a| a * (most / hardest.max(most)))
    }

    /// The wanted acceleration, else the largest part of it beyond the best return that leaves one; without any, the
    /// start of the plan that costs least.
    fn affordable(&self, rods: &Rods, wanted: ByRod, jerk: f64) -> ByRod {
        let wanted_margin = self.margin(&wanted, jerk);
        if wanted_margin >= 0.0 {
            return wanted;
        }
        let (mut best, mut best_margin) = (wanted, f64::NEG_INFINITY);
        for plan in Plan::RETURNS {
            let (start, after) = self.begin(rods, plan, jerk);
            let margin = self.margins.now(&start).min(self.margins.of(plan, &after));
            if margin > best_margin {
                (best, best_margin) = (start, margin);
            }
        }
        if best_margin < 0.0 {
            let urgency = 1.0 + self.margins.missing(best_margin);
            return self.least_harmful(rods, (urgency * jerk).min(self.hardest_jerk()));
        }
        let (mut safe, mut unsafe_one) = (best, wanted);
        for _ in 0..HALVINGS {
            let middle: ByRod = std::array::from_fn(|k| 0.5 * (safe[k] + unsafe_one[k]));
            if self.margin(&middle, jerk) >= 0.0 {
                safe = middle;
            } else {
                unsafe_one = middle;
            }
        }
        safe
    }

    /// The start of the plan that costs least.
    fn least_harmful(&self, rods: &Rods, jerk: f64) -> ByRod {
        let none = self.within_limits(rods, [0.0; MAX_ACTUATORS], jerk);
        let (mut best, mut least) = (none, f64::INFINITY);
        for plan in Plan::ALL {
            let (start, after) = self.begin(rods, plan, jerk);
            let harm = self.margins.harm(plan, &after);
            if harm < least {
                (best, least) = (start, harm);
            }
        }
        best
    }

    /// S(20) (m/s^3)
    fn jerk(&self) -> f64 {
        let hardest = self.hardest_jerk();
        let affordable = self.margins.affordable_jerk(ACCELERATION_RISE_S);
        affordable.clamp(WANTED_SHARE * hardest, hardest)
    }

    fn hardest_jerk(&self) -> f64 {
        self.limits.max_acceleration / ACCELERATION_RISE_S
    }

    /// The margin of an acceleration in the next step: now, and of the best return after it.
    fn margin(&self, acceleration: &ByRod, jerk: f64) -> f64 {
        let now = self.margins.now(acceleration);
        if now < 0.0 {
            return now;
        }
        let mut best = f64::NEG_INFINITY;
        for plan in Plan::RETURNS {
            let after = self.after(acceleration, plan, jerk);
            best = best.max(self.margins.of(plan, &after));
            if best >= 0.0 {
                break;
            }
        }
        best.min(now)
    }

    /// The acceleration of the next step towards a plan, and the rods where it begins.
    fn begin(&self, rods: &Rods, plan: Plan, jerk: f64) -> (ByRod, Rods) {
        let start = self.within_limits(rods, self.margins.start(plan, rods), jerk);
        (start, self.after(&start, plan, jerk))
    }

    /// The rods where a plan begins after a step with this acceleration.
    fn after(&self, acceleration: &ByRod, plan: Plan, jerk: f64) -> Rods {
        let rods = self.margins.after(acceleration, self.limits.step);
        self.margins.begin(plan, &rods, acceleration, jerk)
    }

    /// An acceleration within the rods' limits that changes no faster than it may (m/s^3); rods that move alike keep to it.
    fn within_limits(&self, rods: &Rods, mut acceleration: ByRod, jerk: f64) -> ByRod {
        let reach = jerk * self.limits.step.min(2.0 * ACCELERATION_RISE_S);
        let last = &self.history.last;
        for (k, a) in acceleration[..self.actuators].iter_mut().enumerate() {
            let limits = [-self.max_velocity, self.max_velocity];
            let by_velocity = limits.map(|limit| (limit - rods.v[k]) / self.limits.step);
            let slow = clamp(*a, by_velocity);
            let slow = clamp(slow, [last[k] - reach, last[k] + reach]);
            *a = clamp(slow, self.limits.allowed(rods.x[k], rods.v[k]).range);
        }
        acceleration
    }
}

impl History {
    fn new(arm: usize) -> Self {
        Self {
            home: None,
            arm: vec![0.0; arm],
            arm_reserve: vec![0.0; arm],
            last: [0.0; MAX_ACTUATORS],
        }
    }

    /// The habits of the arm are kept.
    fn reset(&mut self) {
        self.home = None;
        self.last = [0.0; MAX_ACTUATORS];
    }

    fn see_arm(&mut self, state: &State<f64>, joints: &[usize], seconds: f64) {
        let fading = (1.0 - seconds / FORGET_S).max(0.0);
        let places = self.arm.iter_mut().zip(&mut self.arm_reserve);
        for ((most, reserve), &joint) in places.zip(joints) {
            let seen = state.joints[joint].acceleration.abs();
            *most = (*most * fading).max(seen);
            *reserve = most.max(ARM_RESERVE);
        }
    }
}
