//! The optimisation problem of one step: the motion of the rods with the least cost.
//!
//! `literal` (one-step) is the paper's (30)-(31) with (31e), (31f) eliminated: the variables are the rods'
//! accelerations a, and the cost is that of the next state including all its inertia forces,
//! ```text
//!     S(9)   xd+ = xd + dt a,  x+ = x + dt xd+,  xdd+ = a
//! ```
//! For short steps its sign is wrong ([`CriticalStep`](crate::CriticalStep)). `look-ahead` evaluates the end of
//! a move: the variables are the strokes p at which the rods come to rest after the time H, with the static
//! loads and angles there. The move with the least mean square acceleration starts with
//! ```text
//!     S(10)  a = 6 (p - x) / H^2 - 4 xd / H
//! ```
//! and is replanned at every step; p is restricted so that this a is within the present acceleration limits.

use super::limits::{Allowed, RodLimits, clamp};
use crate::condensed::Instant;
use crate::condensed::{MAX_ACTUATORS, SuspendedMachine};
use crate::cost::Evaluation;
use crate::cost::Weights;
use crate::prediction::FromActuator;
use crate::prediction::{PredictedState, RodMotion};
use crate::solve::{Ending, Minimum, minimise};
use tipwatch_mechanics::geometry::coordinate::Motion;
use tipwatch_mechanics::number::{Gradient, Real};

/// The objective and the machine: constant for all steps.
#[derive(Debug, Clone)]
pub(crate) struct ProblemSettings {
    pub(crate) weights: Weights,
    /// Lower bound on the stability angles (rad).
    pub(crate) min_angle: f64,
    /// Look-ahead time (s); `None` for the problem of the paper.
    pub(crate) look_ahead: Option<f64>,
    pub(crate) limits: RodLimits,
}

/// State and limits of a rod.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rod {
    /// (m)
    pub(crate) x: f64,
    /// (m/s)
    pub(crate) v: f64,
    pub(crate) allowed: Allowed,
}

/// A number that depends on one variable.
type Alone = Gradient<1>;

/// A problem in `N` variables: one for all rods, or one per rod.
#[derive(Debug)]
pub(crate) struct Problem<const N: usize>
where
    Gradient<N>: FromActuator<Alone>,
{
    predicted_state: PredictedState<Gradient<N>, Alone>,
    rods: [Motion<Alone>; MAX_ACTUATORS],
    /// Loads as functions of the step, at the last evaluation.
    by_step: Vec<Gradient<N>>,
    /// The last solution, in the units of the variables.
    last: Option<[f64; N]>,
}

/// The solution of a problem.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Solved {
    /// Acceleration of each rod (m/s^2).
    pub(crate) acceleration: [f64; MAX_ACTUATORS],
    /// Variable of each rod, in its unit.
    pub(crate) variable: [f64; MAX_ACTUATORS],
    pub(crate) found: Minimum<MAX_ACTUATORS>,
    /// Whether the step changes the loads in the same direction as the position it leads to: S(8).
    pub(crate) has_right_sign: bool,
}

/// Ranges of the variables.
struct Ranges<const N: usize> {
    middle: [f64; N],
    half: [f64; N],
}

impl<const N: usize> Problem<N>
where
    Gradient<N>: FromActuator<Alone>,
{
    pub(crate) fn new(suspended: &SuspendedMachine) -> Self {
        Self {
            predicted_state: PredictedState::new(suspended),
            rods: [Motion::zero(); MAX_ACTUATORS],
            by_step: vec![Gradient::fixed(0.0); suspended.machine.wheels().len()],
            last: None,
        }
    }

    pub(crate) fn forget(&mut self) {
        self.last = None;
    }

    /// Solves the problem for rods that can all move: see [`Allowed::viable`].
    pub(crate) fn solve(
        &mut self,
        suspended: &SuspendedMachine,
        instant: &Instant,
        settings: &ProblemSettings,
        rods: &[Rod],
    ) -> Solved {
        let ranges = Ranges::of(settings, rods);
        let start = self.start(settings, rods, &ranges);
        let Self {
            predicted_state,
            rods: motions,
            ..
        } = self;
        let found = minimise(start, |z| {
            for (k, (rod, motion)) in rods.iter().zip(motions.iter_mut()).enumerate() {
                let i = variable_of::<N>(k);
                let mut variable = Alone::fixed(ranges.middle[i] + ranges.half[i] * z[i]);
                variable.slopes[0] = ranges.half[i];
                *motion = settings.motion(rod, variable);
            }
            evaluate(
                suspended,
                instant,
                settings,
                predicted_state,
                &motions[..rods.len()],
            )
        });
        let has_right_sign = settings.look_ahead.is_some()
            || found.ending == Ending::NotFinite
            || ranges.half.contains(&0.0)
            || self.has_right_sign(suspended, instant, settings, rods.len(), &ranges);
        let variable: [f64; N] =
            std::array::from_fn(|i| ranges.middle[i] + ranges.half[i] * found.z[i]);
        self.last = variable.iter().all(|u| u.is_finite()).then_some(variable);
        let of = |values: &[f64; N], k: usize| values[variable_of::<N>(k)];
        let acceleration = |k: usize| match rods.get(k) {
            Some(rod) => clamp(
                settings.acceleration(rod, of(&variable, k)),
                rod.allowed.range,
            ),
            None => 0.0,
        };
        Solved {
            acceleration: std::array::from_fn(acceleration),
            variable: std::array::from_fn(|k| of(&variable, k)),
            found: Minimum {
                z: std::array::from_fn(|k| of(&found.z, k)),
                ending: found.ending,
                cost: found.cost,
                iterations: found.iterations,
                evaluations: found.evaluations,
            },
            has_right_sign,
        }
    }

    /// Whether d_X' W d_a is positive definite, from the derivatives of the load differences with respect to the
    /// strokes and to the accelerations of the step, at the last point evaluated.
    fn has_right_sign(
        &mut self,
        suspended: &SuspendedMachine,
        instant: &Instant,
        settings: &ProblemSettings,
        actuators: usize,
        ranges: &Ranges<N>,
    ) -> bool {
        let motions = &mut self.rods[..actuators];
        let predicted_state = &mut self.predicted_state;
        self.by_step.copy_from_slice(&predicted_state.otf);
        for motion in &mut *motions {
            let position = Alone::variable(motion.position.value, 0);
            *motion = Motion::at_rest(position);
        }
        predicted_state.fill(suspended, instant, motions, RodMotion::AtRest, false);
        let by = |i: usize, j: usize| {
            settings
                .weights
                .product(&predicted_state.otf, i, &self.by_step, j)
                / ranges.half[j]
        };
        if N == 1 {
            return by(0, 0) > 0.0;
        }
        let off = 0.5 * (by(0, 1) + by(1, 0));
        by(0, 0) > 0.0 && by(0, 0) * by(1, 1) > off * off
    }

    /// Start of the search: the last solution, else the present strokes or zero acceleration.
    fn start(&self, settings: &ProblemSettings, rods: &[Rod], ranges: &Ranges<N>) -> [f64; N] {
        std::array::from_fn(|i| {
            let here = if settings.look_ahead.is_some() {
                rods[i].x
            } else {
                0.0
            };
            let from = self.last.map_or(here, |last| last[i]);
            let z = (from - ranges.middle[i]) / ranges.half[i];
            if z.is_nan() { 0.0 } else { z }
        })
    }
}

/// Index of the variable that controls a rod.
fn variable_of<const N: usize>(rod: usize) -> usize {
    rod.min(N - 1)
}

/// Cost and margins for a motion of the rods: loads relative to the mean load, angles in rad.
fn evaluate<const N: usize>(
    suspended: &SuspendedMachine,
    instant: &Instant,
    settings: &ProblemSettings,
    predicted_state: &mut PredictedState<Gradient<N>, Alone>,
    rods: &[Motion<Alone>],
) -> Evaluation<N>
where
    Gradient<N>: FromActuator<Alone>,
{
    let rod_motion = match settings.look_ahead {
        Some(_) => RodMotion::AtRest,
        None => RodMotion::InMotion,
    };
    let with_angles = settings.uses_angles();
    predicted_state.fill(suspended, instant, rods, rod_motion, with_angles);
    let angles = if with_angles {
        &predicted_state.angle[..]
    } else {
        &[]
    };
    let machine = &suspended.machine;
    let mean = machine.gravity() * instant.condensed.mass() / machine.wheels().len() as f64;
    Evaluation::of(
        &settings.weights,
        &predicted_state.otf,
        mean,
        angles,
        settings.min_angle,
    )
}

impl ProblemSettings {
    /// Whether stability angles matter, which require the direction of gravity.
    pub(crate) fn uses_angles(&self) -> bool {
        self.weights.use_angles() || self.min_angle > 0.0
    }

    /// Motion of a rod for a value of its variable: S(9), or at rest at the end of its move.
    fn motion<T: Real>(&self, rod: &Rod, variable: T) -> Motion<T> {
        if self.look_ahead.is_some() {
            return Motion::at_rest(variable);
        }
        let dt = self.limits.step;
        let rate = T::constant(rod.v) + variable.scaled(dt);
        Motion {
            position: T::constant(rod.x) + rate.scaled(dt),
            rate,
            acceleration: variable,
        }
    }

    /// Acceleration of a rod for a value of its variable: S(10).
    fn acceleration(&self, rod: &Rod, variable: f64) -> f64 {
        match self.look_ahead {
            Some(h) => 6.0 * (variable - rod.x) / (h * h) - 4.0 * rod.v / h,
            None => variable,
        }
    }

    /// Value of the variable for an acceleration: the inverse of S(10).
    fn variable(&self, rod: &Rod, acceleration: f64) -> f64 {
        match self.look_ahead {
            Some(h) => rod.x + 2.0 / 3.0 * h * rod.v + h * h / 6.0 * acceleration,
            None => acceleration,
        }
    }
}

impl<const N: usize> Ranges<N> {
    /// The common range of the rods of each variable; for rods so far apart that none exists, the value midway
    /// between them.
    fn of(settings: &ProblemSettings, rods: &[Rod]) -> Self {
        let mut ranges = [[f64::NEG_INFINITY, f64::INFINITY]; N];
        for (k, rod) in rods.iter().enumerate() {
            let range = &mut ranges[variable_of::<N>(k)];
            let mut reach = rod.allowed.range.map(|a| settings.variable(rod, a));
            if settings.look_ahead.is_some() {
                reach = reach.map(|p| clamp(p, settings.limits.stroke));
            }
            range[0] = range[0].max(reach[0]);
            range[1] = range[1].min(reach[1]);
        }
        let middle = ranges.map(|[least, greatest]| 0.5 * (least + greatest));
        Self {
            middle,
            half: ranges.map(|[least, greatest]| (0.5 * (greatest - least)).max(0.0)),
        }
    }
}
