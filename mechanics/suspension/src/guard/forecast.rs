//! Forecast: what locked rods give over the next two seconds, what the suspension adds to that, and how far both may be
//! wrong.
//!
//! ```text
//!     S(12)  D(x + dx, v, a) = D(x) + X dx + V v + c A a,   D = N - N_lock,   X, V, A = dN/dx, dN/dxd, dN/dxdd
//!     S(13)  q(t) = q + q' t + q'' T (t - T (1 - exp(-t/T)))                                    the arm goes on, base as now
//!     S(14)  doubt(t) = r(t) sum |dN/df| b + sum over joints (r(t) |dN/dq''| + t^2/2 |dN/dq|) b_q
//! ```
//! N_lock are the loads with the rods where control began, on the mean motion of the ground, S(18). S(14) is what a motion
//! may add that nobody announced: a base acceleration b, and an acceleration b_q of each joint of the arm; r rises to 1.

use nalgebra::Vector3;

use super::by_wheel::ByWheel;
use super::steady::Steady;
use crate::condensed::{Instant, MAX_ACTUATORS, SuspendedMachine};
use crate::prediction::{PredictedState, RodMotion};
use tipwatch_mechanics::geometry::coordinate::Motion;
use tipwatch_mechanics::machine::MAX_WHEELS;
use tipwatch_mechanics::number::Gradient;
use tipwatch_mechanics::state::{ImuState, State};

/// Times of the forecast (s).
pub(super) const TIMES_S: [f64; 4] = [0.0, 0.5, 1.0, 1.8];
/// Index of the time at which doubt is computed.
const DOUBT_AT: usize = 1;
/// T of S(13): duration of an acceleration of the arm (s).
const LASTING_S: f64 = 0.5;
/// b of S(14): the largest sudden acceleration of the base so far, at least this (m/s^2).
const BASE_RESERVE: f64 = 0.2;
/// Steps of the difference quotients: position (rad or m), acceleration (per s^2).
const POSITION_STEP: f64 = 0.05;
const ACCELERATION_STEP: f64 = 1.0;
/// c: a platform on tyres and oil answers a sudden acceleration twofold.
const OVERSHOOT: f64 = 2.0;

/// A number by rod.
pub(super) type ByRod = [f64; MAX_ACTUATORS];

/// Effect of the suspension on loads (N) or angles (rad), as a function of the rods.
#[derive(Debug, Clone, Copy)]
pub(super) struct Added {
    /// Effect of the rods at rest at the present reference.
    pub(super) here: ByWheel,
    /// Derivative with respect to stroke (1/m), by actuator.
    pub(super) by_position: [ByWheel; MAX_ACTUATORS],
    /// Derivative with respect to velocity (s/m), by actuator.
    pub(super) by_velocity: [ByWheel; MAX_ACTUATORS],
    /// Derivative with respect to acceleration (s^2/m), by actuator, overshoot included.
    pub(super) by_acceleration: [ByWheel; MAX_ACTUATORS],
}

/// The forecast for one time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Outlook {
    /// N_lock (N).
    pub(super) locked: ByWheel,
    pub(super) load: Added,
    /// Angles with the rods locked, NaN if the direction of gravity is unknown.
    pub(super) locked_angle: ByWheel,
    pub(super) angle: Added,
}

/// S(14), by wheel (N).
#[derive(Debug, Clone, Copy)]
pub(super) struct Doubt {
    /// Load lost by an unannounced acceleration of the base.
    pub(super) by_base: ByWheel,
    /// Load lost at once by an unannounced acceleration of the arm.
    pub(super) by_arm: ByWheel,
    /// Load lost by the arm's displacement under that acceleration, per t^2/2 (N/s^2).
    pub(super) by_square: ByWheel,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Forecast {
    pub(super) wheels: usize,
    pub(super) edges: usize,
    pub(super) at: [Outlook; TIMES_S.len()],
    pub(super) doubt: Doubt,
    /// S(19) by wheel (N).
    pub(super) swing: ByWheel,
}

impl Added {
    const NONE: Self = Self {
        here: [0.0; MAX_WHEELS],
        by_position: [[0.0; MAX_WHEELS]; MAX_ACTUATORS],
        by_velocity: [[0.0; MAX_WHEELS]; MAX_ACTUATORS],
        by_acceleration: [[0.0; MAX_WHEELS]; MAX_ACTUATORS],
    };
}

impl Outlook {
    const UNKNOWN: Self = Self {
        locked: [0.0; MAX_WHEELS],
        load: Added::NONE,
        locked_angle: [f64::NAN; MAX_WHEELS],
        angle: Added {
            here: [f64::NAN; MAX_WHEELS],
            ..Added::NONE
        },
    };
}

impl Doubt {
    const NONE: Self = Self {
        by_base: [0.0; MAX_WHEELS],
        by_arm: [0.0; MAX_WHEELS],
        by_square: [0.0; MAX_WHEELS],
    };
}

impl Forecast {
    /// The smallest stability angle of locked rods now (rad); infinite if it is unknown.
    pub(super) fn least_locked_angle(&self) -> f64 {
        let angles = self.at[0].locked_angle[..self.edges].iter();
        angles.fold(f64::INFINITY, |least, &angle| least.min(angle))
    }

    /// Whether every number that the guard needs is finite; angles may be unknown.
    pub(super) fn is_known(&self) -> bool {
        let known = |values: &ByWheel| values[..self.wheels].iter().all(|value| value.is_finite());
        let of_load = |outlook: &Outlook| {
            known(&outlook.locked)
                && known(&outlook.load.here)
                && outlook.load.by_position.iter().all(known)
                && outlook.load.by_velocity.iter().all(known)
                && outlook.load.by_acceleration.iter().all(known)
        };
        self.at.iter().all(of_load)
            && [
                &self.doubt.by_base,
                &self.doubt.by_arm,
                &self.doubt.by_square,
            ]
            .into_iter()
            .all(known)
    }
}

/// Computes forecasts; memory is reused every step.
#[derive(Debug)]
pub(super) struct Forecaster {
    suspended: SuspendedMachine,
    /// Joints of the arm.
    arm: Vec<usize>,
    /// S(13): factors of q'' in q, q' and q'' at each time.
    lasting: [[f64; 3]; TIMES_S.len()],
    steady: Steady,
    now: Instant,
    ahead: Instant,
    state_ahead: State<f64>,
    scratch: PredictedState<f64>,
    still: PredictedState<f64>,
    varied: PredictedState<Gradient<6>>,
}

impl Forecaster {
    pub(super) fn new(suspended: &SuspendedMachine) -> Self {
        let machine = &suspended.machine;
        let is_rod = |joint: usize| {
            let mut linkages = suspended.linkages.iter();
            linkages.any(|&linkage| machine.linkages()[linkage].measured_joint == joint)
        };
        let arm = (0..machine.joints().len())
            .filter(|&joint| machine.joints()[joint].spins_wheel.is_none() && !is_rod(joint));
        Self {
            arm: arm.collect(),
            lasting: TIMES_S.map(|t| {
                let left = libm::exp(-t / LASTING_S);
                let gone = LASTING_S * (1.0 - left);
                [LASTING_S * (t - gone), gone, left]
            }),
            steady: Steady::UNKNOWN,
            now: Instant::new(suspended),
            ahead: Instant::new(suspended),
            state_ahead: State::zero(machine),
            scratch: PredictedState::new(suspended),
            still: PredictedState::new(suspended),
            varied: PredictedState::new(suspended),
            suspended: suspended.clone(),
        }
    }

    /// Joints of the arm, which [`Self::find`] expects the reserves of.
    pub(super) fn arm(&self) -> &[usize] {
        &self.arm
    }

    /// Takes the state some seconds after the last one, for rods at the strokes `x` (m) with velocities `v` (m/s), home
    /// for locked ones. Returns the mean motion of the ground, S(18).
    pub(super) fn observe(
        &mut self,
        state: &State<f64>,
        [x, v]: [&ByRod; 2],
        home: &ByRod,
        seconds: f64,
    ) -> ImuState<f64> {
        let actuators = self.suspended.linkages.len();
        let mut rods = self.suspended.rods(state);
        for (k, rod) in rods.iter_mut().enumerate() {
            (rod.position, rod.rate) = (x[k], v[k]);
        }
        let rods = &rods[..actuators];
        self.now
            .fill(&self.suspended, state, rods, &mut self.scratch);
        let measured = self.now.on_ground;
        let mean = self.steady.see(&measured, seconds);
        self.go_on(state, 0, home);
        let by_measured = self.locked(home, false);
        self.now.on_ground = mean;
        self.ahead.on_ground = mean;
        let by_mean = self.locked(home, false);
        self.steady.see_loads(&by_measured, &by_mean, seconds);
        mean
    }

    /// The forecast for the state that was observed last, for rods at the strokes `x` (m) and for those locked at `home`,
    /// with an unannounced acceleration of each joint of the arm (rad/s^2 or m/s^2).
    pub(super) fn find(
        &mut self,
        state: &State<f64>,
        x: &ByRod,
        home: &ByRod,
        arm_reserve: &[f64],
    ) -> Forecast {
        let base_reserve = self.steady.shock().max(BASE_RESERVE);
        let machine = &self.suspended.machine;
        let mut found = Forecast {
            wheels: machine.wheels().len().min(MAX_WHEELS),
            edges: machine.polygon().edges().len().min(MAX_WHEELS),
            at: [Outlook::UNKNOWN; TIMES_S.len()],
            doubt: Doubt::NONE,
            swing: *self.steady.swing(),
        };
        for at in 0..TIMES_S.len() {
            self.go_on(state, at, home);
            found.at[at] = self.outlook(x, home);
            if at == DOUBT_AT {
                let locked = &found.at[at].locked;
                found.doubt = self.doubt(locked, home, base_reserve, arm_reserve);
            }
        }
        found
    }

    /// Makes `ahead` the instant after `TIMES_S[at]`, the base moving as it does now.
    fn go_on(&mut self, state: &State<f64>, at: usize, home: &ByRod) {
        let ahead = &mut self.state_ahead;
        ahead.joints.clone_from(&state.joints);
        let [position, rate, left] = self.lasting[at];
        let joints = self.suspended.machine.joints();
        for (joint, known) in ahead.joints.iter_mut().zip(joints) {
            joint.position += TIMES_S[at] * joint.rate + position * joint.acceleration;
            joint.rate += rate * joint.acceleration;
            joint.acceleration *= left;
            if at > 0
                && let Some([least, greatest]) = known.limits
                && !(least..=greatest).contains(&joint.position)
                && known.spins_wheel.is_none()
            {
                let position = joint.position.max(least).min(greatest);
                *joint = Motion::at_rest(position);
            }
        }
        ahead.imu = state.imu;
        ahead.base.up = state.base.up;
        ahead.tool_wrench = state.tool_wrench;
        ahead.payload_share.clone_from(&state.payload_share);
        self.fill_ahead(home);
    }

    fn fill_ahead(&mut self, home: &ByRod) {
        let rods = at_rest(home);
        let rods = &rods[..self.suspended.linkages.len()];
        self.ahead
            .fill(&self.suspended, &self.state_ahead, rods, &mut self.scratch);
        self.ahead.on_ground = self.now.on_ground;
        self.ahead.up_on_ground = self.now.up_on_ground;
    }

    /// S(12) at the instant `ahead`.
    fn outlook(&mut self, x: &ByRod, home: &ByRod) -> Outlook {
        let mut found = Outlook::UNKNOWN;
        let actuators = self.suspended.linkages.len();
        let with_angles = has_up(&self.ahead.up_on_ground);
        found.locked = self.locked(home, with_angles);
        if with_angles {
            copy(&mut found.locked_angle, &self.still.angle);
        }
        let mut rods = [Motion::<Gradient<6>>::zero(); MAX_ACTUATORS];
        for (k, rod) in rods.iter_mut().enumerate() {
            rod.position = Gradient::variable(x[k], k);
            rod.rate = Gradient::variable(0.0, MAX_ACTUATORS + k);
            rod.acceleration = Gradient::variable(0.0, 2 * MAX_ACTUATORS + k);
        }
        self.varied.fill(
            &self.suspended,
            &self.ahead,
            &rods[..actuators],
            RodMotion::InMotion,
            with_angles,
        );
        read(&mut found.load, &self.varied.otf, &found.locked);
        if with_angles {
            read(&mut found.angle, &self.varied.angle, &found.locked_angle);
        }
        found
    }

    /// Loads with the rods at rest at `home`, at the instant `ahead`.
    fn locked(&mut self, home: &ByRod, with_angles: bool) -> ByWheel {
        let rods = at_rest(home);
        self.still.fill(
            &self.suspended,
            &self.ahead,
            &rods[..self.suspended.linkages.len()],
            RodMotion::AtRest,
            with_angles,
        );
        let mut loads = [0.0; MAX_WHEELS];
        copy(&mut loads, &self.still.otf);
        loads
    }

    /// S(14) at the instant `ahead`, where locked rods give `locked`.
    fn doubt(
        &mut self,
        locked: &ByWheel,
        home: &ByRod,
        base_reserve: f64,
        arm_reserve: &[f64],
    ) -> Doubt {
        let mut doubt = Doubt::NONE;
        let add = |sum: &mut ByWheel, loads: &ByWheel, factor: f64| {
            for ((sum, load), locked) in sum.iter_mut().zip(loads).zip(locked) {
                *sum += factor * (load - locked).abs();
            }
        };
        for axis in 0..2 {
            self.ahead.on_ground.specific_force[axis] += 1.0;
            let loads = self.locked(home, false);
            add(&mut doubt.by_base, &loads, base_reserve);
            self.ahead.on_ground = self.now.on_ground;
        }
        for k in 0..self.arm.len() {
            let joint = self.arm[k];
            let reserve = arm_reserve.get(k).copied().unwrap_or(0.0);
            let kept = self.state_ahead.joints[joint];
            self.state_ahead.joints[joint].position += POSITION_STEP;
            self.fill_ahead(home);
            let loads = self.locked(home, false);
            add(&mut doubt.by_square, &loads, reserve / POSITION_STEP);
            self.state_ahead.joints[joint] = kept;
            self.state_ahead.joints[joint].acceleration += ACCELERATION_STEP;
            self.fill_ahead(home);
            let loads = self.locked(home, false);
            add(&mut doubt.by_arm, &loads, reserve / ACCELERATION_STEP);
            self.state_ahead.joints[joint] = kept;
        }
        doubt
    }
}

/// Fills `added` with the effect of the suspension on these values: their differences from `locked`, and their derivatives.
fn read(added: &mut Added, values: &[Gradient<6>], locked: &ByWheel) {
    for (i, value) in values.iter().take(MAX_WHEELS).enumerate() {
        added.here[i] = value.value - locked[i];
        for k in 0..MAX_ACTUATORS {
            added.by_position[k][i] = value.slopes[k];
            added.by_velocity[k][i] = value.slopes[MAX_ACTUATORS + k];
            added.by_acceleration[k][i] = OVERSHOOT * value.slopes[2 * MAX_ACTUATORS + k];
        }
    }
}

fn copy(places: &mut ByWheel, values: &[f64]) {
    for (place, &value) in places.iter_mut().zip(values) {
        *place = value;
    }
}

fn at_rest(strokes: &ByRod) -> [Motion<f64>; MAX_ACTUATORS] {
    strokes.map(Motion::at_rest)
}

fn has_up(up: &Vector3<f64>) -> bool {
    up.iter().all(|x| x.is_finite())
}
