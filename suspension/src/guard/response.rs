//! How wheel loads and stability angles respond to the rods, now and in a short while.
//!
//! ```text
//!     S(12)  N(x + dx, a) = N(x) + X dx + A a,   X = dN/dx,  A = dN/dxdd           about the present reference
//!     S(13)  N_lock(t) = N_lock + (N_lock(tau) - N_lock) t/tau                     rods locked where control began
//! ```
//! The second one extrapolates the arm: each joint goes on with its velocity and acceleration, the base with its own.

use nalgebra::Vector3;

use crate::condensed::{Instant, MAX_ACTUATORS, SuspendedMachine};
use crate::prediction::{PredictedState, RodMotion};
use tipwatch_mechanics::geometry::coordinate::Motion;
use tipwatch_mechanics::machine::MAX_WHEELS;
use tipwatch_mechanics::number::Gradient;
use tipwatch_mechanics::state::State;

/// tau of S(13) (s).
const AHEAD_S: f64 = 0.4;

const POSITION: usize = 0;
const ACCELERATION: usize = 1;

/// By wheel or edge; entries beyond their number are zero.
pub(super) type ByWheel = [f64; MAX_WHEELS];

/// Loads (N) and stability angles (rad) about the present motion of the rods.
#[derive(Debug, Clone, Copy)]
pub(super) struct Response {
    pub(super) wheels: usize,
    pub(super) edges: usize,
    /// N(x).
    pub(super) load: ByWheel,
    /// X, by actuator (N/m).
    pub(super) by_position: [ByWheel; MAX_ACTUATORS],
    /// A, by actuator (N s^2/m).
    pub(super) by_acceleration: [ByWheel; MAX_ACTUATORS],
    /// Angles at x, NaN if the direction of gravity is unknown.
    pub(super) angle: ByWheel,
    /// Their derivatives with respect to stroke, by actuator (rad/m).
    pub(super) angle_by_position: [ByWheel; MAX_ACTUATORS],
    /// N_lock now.
    pub(super) locked: ByWheel,
    /// N_lock after `AHEAD_S`.
    pub(super) locked_ahead: ByWheel,
    /// Angles with the rods locked, now.
    pub(super) locked_angle: ByWheel,
    /// The same after `AHEAD_S`.
    pub(super) locked_angle_ahead: ByWheel,
}

impl Response {
    /// The lowest load of a wheel with the rods locked, over the next `seconds`: S(13).
    pub(super) fn least_locked(&self, wheel: usize, seconds: f64) -> f64 {
        least_within(self.locked[wheel], self.locked_ahead[wheel], seconds)
    }

    /// The same for the stability angle over an edge.
    pub(super) fn least_locked_angle(&self, edge: usize, seconds: f64) -> f64 {
        let (now, ahead) = (self.locked_angle[edge], self.locked_angle_ahead[edge]);
        least_within(now, ahead, seconds)
    }

    /// Whether every number that the guard needs is finite; angles may be unknown.
    pub(super) fn is_known(&self) -> bool {
        let known = |values: &ByWheel| values[..self.wheels].iter().all(|value| value.is_finite());
        known(&self.load)
            && known(&self.locked)
            && known(&self.locked_ahead)
            && self.by_position.iter().all(known)
            && self.by_acceleration.iter().all(known)
    }
}

/// Computes responses; memory is reused every step.
#[derive(Debug)]
pub(super) struct ResponseFinder {
    suspended: SuspendedMachine,
    now: Instant,
    ahead: Instant,
    state_ahead: State<f64>,
    scratch: PredictedState<f64>,
    still: PredictedState<f64>,
    varied: PredictedState<Gradient<2>>,
}

impl ResponseFinder {
    pub(super) fn new(suspended: &SuspendedMachine) -> Self {
        Self {
            now: Instant::new(suspended),
            ahead: Instant::new(suspended),
            state_ahead: State::zero(&suspended.machine),
            scratch: PredictedState::new(suspended),
            still: PredictedState::new(suspended),
            varied: PredictedState::new(suspended),
            suspended: suspended.clone(),
        }
    }

    /// The response for the rods at the strokes `x` (m) with velocities `v` (m/s), and for those locked at `home`.
    pub(super) fn find(
        &mut self,
        state: &State<f64>,
        x: &[f64],
        v: &[f64],
        home: &[f64; MAX_ACTUATORS],
    ) -> Response {
        let actuators = self.suspended.linkages.len();
        let mut rods = [Motion::zero(); MAX_ACTUATORS];
        for (k, &linkage) in self.suspended.linkages.iter().enumerate() {
            let linkage = &self.suspended.machine.linkages()[linkage];
            let measured = linkage.solve(&state.joints[linkage.measured_joint]);
            rods[k] = Motion {
                position: x[k],
                rate: v[k],
                acceleration: measured.rod.acceleration,
            };
        }
        self.now.fill(
            &self.suspended,
            state,
            &rods[..actuators],
            &mut self.scratch,
        );
        let mut found = Response {
            wheels: self.suspended.machine.wheels().len().min(MAX_WHEELS),
            edges: self
                .suspended
                .machine
                .polygon()
                .edges()
                .len()
                .min(MAX_WHEELS),
            load: [0.0; MAX_WHEELS],
            by_position: [[0.0; MAX_WHEELS]; MAX_ACTUATORS],
            by_acceleration: [[0.0; MAX_WHEELS]; MAX_ACTUATORS],
            angle: [f64::NAN; MAX_WHEELS],
            angle_by_position: [[0.0; MAX_WHEELS]; MAX_ACTUATORS],
            locked: [0.0; MAX_WHEELS],
            locked_ahead: [0.0; MAX_WHEELS],
            locked_angle: [f64::NAN; MAX_WHEELS],
            locked_angle_ahead: [f64::NAN; MAX_WHEELS],
        };
        for actuator in 0..actuators {
            self.vary(&mut found, x, actuator);
        }
        (found.locked, found.locked_angle) = self.locked(home, actuators);
        self.look_ahead(state, home, actuators);
        (found.locked_ahead, found.locked_angle_ahead) = self.locked(home, actuators);
        found
    }

    /// Loads and angles at rest at x, and their derivatives with respect to one actuator.
    fn vary(&mut self, found: &mut Response, x: &[f64], actuator: usize) {
        let mut rods = [Motion::<Gradient<2>>::zero(); MAX_ACTUATORS];
        for (k, (rod, &x)) in rods.iter_mut().zip(x).enumerate() {
            rod.position.value = x;
            if k == actuator {
                rod.position.slopes[POSITION] = 1.0;
                rod.acceleration.slopes[ACCELERATION] = 1.0;
            }
        }
        let (suspended, varied) = (&self.suspended, &mut self.varied);
        let with_angles = has_up(&self.now.up_on_ground);
        varied.fill(
            suspended,
            &self.now,
            &rods[..x.len()],
            RodMotion::InMotion,
            with_angles,
        );
        for (wheel, load) in varied.otf.iter().take(MAX_WHEELS).enumerate() {
            found.load[wheel] = load.value;
            found.by_position[actuator][wheel] = load.slopes[POSITION];
            found.by_acceleration[actuator][wheel] = load.slopes[ACCELERATION];
        }
        if with_angles {
            for (edge, angle) in varied.angle.iter().take(MAX_WHEELS).enumerate() {
                found.angle[edge] = angle.value;
                found.angle_by_position[actuator][edge] = angle.slopes[POSITION];
            }
        }
    }

    /// Loads and angles with the rods at rest at `home`, at the instant `now`.
    fn locked(&mut self, home: &[f64; MAX_ACTUATORS], actuators: usize) -> (ByWheel, ByWheel) {
        let rods = home.map(|position| Motion {
            position,
            ..Motion::zero()
        });
        let with_angles = has_up(&self.now.up_on_ground);
        self.still.fill(
            &self.suspended,
            &self.now,
            &rods[..actuators],
            RodMotion::AtRest,
            with_angles,
        );
        let (mut loads, mut angles) = ([0.0; MAX_WHEELS], [f64::NAN; MAX_WHEELS]);
        for (place, &load) in loads.iter_mut().zip(&self.still.otf) {
            *place = load;
        }
        if with_angles {
            for (place, &angle) in angles.iter_mut().zip(&self.still.angle) {
                *place = angle;
            }
        }
        (loads, angles)
    }

    /// Makes the instant that of the arm after `AHEAD_S`, the base moving as it does now.
    fn look_ahead(&mut self, state: &State<f64>, home: &[f64; MAX_ACTUATORS], actuators: usize) {
        let ahead = &mut self.state_ahead;
        ahead.joints.clone_from(&state.joints);
        for joint in &mut ahead.joints {
            let t = AHEAD_S;
            joint.position += t * (joint.rate + 0.5 * t * joint.acceleration);
            joint.rate += t * joint.acceleration;
        }
        ahead.imu = state.imu;
        ahead.base.up = state.base.up;
        ahead.tool_wrench = state.tool_wrench;
        ahead.payload_share.clone_from(&state.payload_share);
        let rods = home.map(|position| Motion {
            position,
            ..Motion::zero()
        });
        let rods = &rods[..actuators];
        self.ahead
            .fill(&self.suspended, ahead, rods, &mut self.scratch);
        // the base's motion is that of now
        self.ahead.on_ground = self.now.on_ground;
        self.ahead.up_on_ground = self.now.up_on_ground;
        std::mem::swap(&mut self.now, &mut self.ahead);
    }
}

/// The smallest value within `seconds`, from those now and after `AHEAD_S`.
fn least_within(now: f64, ahead: f64, seconds: f64) -> f64 {
    now + (ahead - now).min(0.0) * (seconds / AHEAD_S)
}

fn has_up(up: &Vector3<f64>) -> bool {
    up.iter().all(|x| x.is_finite())
}
