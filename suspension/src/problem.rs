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

use crate::evaluation::Evaluation;
use crate::instant::Instant;
use crate::limits::{Allowed, RodLimits, clamp};
use crate::minimise::{Ending, Minimum, minimise};
use crate::predicted_state::{Own, PredictedState};
use crate::response::Among;
use crate::suspended_machine::{MAX_ACTUATORS, SuspendedMachine};
use crate::weights::Weights;
use tipwatch_mechanics::geometry::coordinate::Motion;
use tipwatch_mechanics::number::{Gradient, Real};

/// The objective and the machine: constant for all steps.
#[derive(Debug, Clone)]
pub(super) struct Aim {
    pub(super) weights: Weights,
    /// Lower bound on the stability angles (rad).
    pub(super) min_angle: f64,
    /// Look-ahead time (s); `None` for the problem of the paper.
    pub(super) look_ahead: Option<f64>,
    pub(super) limits: RodLimits,
}

/// State and limits of a rod.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rod {
    /// (m)
    pub(super) x: f64,
    /// (m/s)
    pub(super) v: f64,
    pub(super) allowed: Allowed,
}

/// A number that depends on one variable.
type Alone = Gradient<1>;

/// A problem in `N` variables: one for all rods, or one per rod.
#[derive(Debug)]
pub(super) struct Problem<const N: usize>
where
    Gradient<N>: Among<Alone>,
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
pub(super) struct Solved {
    /// Acceleration of each rod (m/s^2).
    pub(super) acceleration: [f64; MAX_ACTUATORS],
    /// Variable of each rod, in its unit.
    pub(super) variable: [f64; MAX_ACTUATORS],
    pub(super) found: Minimum<MAX_ACTUATORS>,
    /// Whether the step changes the loads in the same direction as the position it leads to: S(8).
    pub(super) steers_right: bool,
}

/// Ranges of the variables.
struct Ranges<const N: usize> {
    middle: [f64; N],
    half: [f64; N],
}

impl<const N: usize> Problem<N>
where
    Gradient<N>: Among<Alone>,
{
    pub(super) fn new(suspended: &SuspendedMachine) -> Self {
        Self {
            predicted_state: PredictedState::new(suspended),
            rods: [Motion::zero(); MAX_ACTUATORS],
            by_step: vec![Gradient::fixed(0.0); suspended.machine.wheels().len()],
            last: None,
        }
    }

    pub(super) fn forget(&mut self) {
        self.last = None;
    }

    /// Solves it for rods that can all move: see [`Allowed::viable`].
    pub(super) fn solve(
        &mut self,
        suspended: &SuspendedMachine,
        instant: &Instant,
        aim: &Aim,
        rods: &[Rod],
    ) -> Solved {
        let ranges = Ranges::of(aim, rods);
        let start = self.start(aim, rods, &ranges);
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
                *motion = aim.motion(rod, variable);
            }
            evaluate(
                suspended,
                instant,
                aim,
                predicted_state,
                &motions[..rods.len()],
            )
        });
        let steers_right = aim.look_ahead.is_some()
            || found.ending == Ending::NotFinite
            || ranges.half.contains(&0.0)
            || self.steers_right(suspended, instant, aim, rods.len(), &ranges);
        let variable: [f64; N] =
            std::array::from_fn(|i| ranges.middle[i] + ranges.half[i] * found.z[i]);
        self.last = variable.iter().all(|u| u.is_finite()).then_some(variable);
        let of = |values: &[f64; N], k: usize| values[variable_of::<N>(k)];
        let acceleration = |k: usize| match rods.get(k) {
            Some(rod) => clamp(aim.acceleration(rod, of(&variable, k)), rod.allowed.range),
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
            steers_right,
        }
    }

    /// Whether d_X' W d_a is positive definite, from the derivatives of the load differences with respect to the
    /// strokes and to the accelerations of the step, at the last point evaluated.
    fn steers_right(
        &mut self,
        suspended: &SuspendedMachine,
        instant: &Instant,
        aim: &Aim,
        actuators: usize,
        ranges: &Ranges<N>,
    ) -> bool {
        let motions = &mut self.rods[..actuators];
        let predicted_state = &mut self.predicted_state;
        self.by_step.copy_from_slice(&predicted_state.otf);
        for motion in &mut *motions {
            let position = Alone::variable(motion.position.value, 0);
            *motion = Motion {
                position,
                ..Motion::zero()
            };
        }
        predicted_state.fill(suspended, instant, motions, Own::AtRest, false);
        let by = |i: usize, j: usize| {
            aim.weights
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
    fn start(&self, aim: &Aim, rods: &[Rod], ranges: &Ranges<N>) -> [f64; N] {
        std::array::from_fn(|i| {
            let here = if aim.look_ahead.is_some() {
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
    aim: &Aim,
    predicted_state: &mut PredictedState<Gradient<N>, Alone>,
    rods: &[Motion<Alone>],
) -> Evaluation<N>
where
    Gradient<N>: Among<Alone>,
{
    let own = match aim.look_ahead {
        Some(_) => Own::AtRest,
        None => Own::InMotion,
    };
    let with_angles = aim.counts_angles();
    predicted_state.fill(suspended, instant, rods, own, with_angles);
    let angles = if with_angles {
        &predicted_state.angle[..]
    } else {
        &[]
    };
    let machine = &suspended.machine;
    let mean = machine.gravity() * instant.condensed.mass() / machine.wheels().len() as f64;
    Evaluation::of(
        &aim.weights,
        &predicted_state.otf,
        mean,
        angles,
        aim.min_angle,
    )
}

impl Aim {
    /// Whether stability angles matter, which require the direction of gravity.
    pub(super) fn counts_angles(&self) -> bool {
        self.weights.count_angles() || self.min_angle > 0.0
    }

    /// Motion of a rod for a value of its variable: S(9), or at rest at the end of its move.
    fn motion<T: Real>(&self, rod: &Rod, variable: T) -> Motion<T> {
        if self.look_ahead.is_some() {
            return Motion {
                position: variable,
                ..Motion::zero()
            };
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
    fn of(aim: &Aim, rods: &[Rod]) -> Self {
        let mut ranges = [[f64::NEG_INFINITY, f64::INFINITY]; N];
        for (k, rod) in rods.iter().enumerate() {
            let range = &mut ranges[variable_of::<N>(k)];
            let mut reach = rod.allowed.range.map(|a| aim.variable(rod, a));
            if aim.look_ahead.is_some() {
                reach = reach.map(|p| clamp(p, aim.limits.stroke));
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
