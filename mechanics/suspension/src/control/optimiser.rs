//! The suspension optimiser: from the state of the machine to the next motion of its suspension.

use super::command::{Command, Status};
use crate::condensed::Instant;
use crate::condensed::MAX_ACTUATORS;
use crate::condensed::{STROKE_POSITIONS, SuspendedMachine};
use crate::cost::Weights;
use crate::error::{STEP_FACTOR, SuspensionError};
use crate::prediction::PredictedState;
use crate::problem::{Allowed, RodLimits, clamp};
use crate::problem::{CriticalStep, StepFinder};
use crate::problem::{Problem, ProblemSettings, Rod, Solved};
use crate::solve::Ending;
use tipwatch_mechanics::geometry::coordinate::Motion;
use tipwatch_mechanics::machine::{ControlMode, Machine, Suspension, SuspensionControl};
use tipwatch_mechanics::resting_state;
use tipwatch_mechanics::state::{ImuState, State};

/// Computes, step by step, how the rods of an active suspension should move to keep the wheels on the ground:
/// (30)-(31) of the second paper, see [`ControlMode`].
///
/// A step does not allocate and its work is bounded: [`SuspensionOptimiser::MAX_EVALUATIONS`]. For any input, every
/// command is within the rods' limits.
#[derive(Debug)]
pub struct SuspensionOptimiser {
    suspended: SuspendedMachine,
    settings: ProblemSettings,
    independent: bool,
    problem: Variables,
    instant: Instant,
    scratch: PredictedState<f64>,
    finder: StepFinder,
    /// The last commanded stroke, by rod (m).
    reference: Option<[f64; MAX_ACTUATORS]>,
    /// Whether the last step could only stop the rods.
    stopping: bool,
}

/// The problem, by number of variables.
#[derive(Debug)]
enum Variables {
    /// All rods move alike.
    One(Box<Problem<1>>),
    /// Each rod individually.
    Two(Box<Problem<2>>),
}

impl SuspensionOptimiser {
    /// Maximum number of evaluations of the machine per step.
    pub const MAX_EVALUATIONS: usize = crate::solve::MAX_EVALUATIONS;

    /// Creates the optimiser of a machine, with `control` instead of the settings in its machine file. In one-step mode the joint
    /// positions (rad or m), in the order of [`Machine::joints`], are the posture for which the step length is checked.
    ///
    /// # Errors
    /// [`SuspensionError`]: the machine has no suspension that can be controlled like this.
    pub fn new(
        machine: &Machine,
        control: &SuspensionControl,
        joint_positions: &[f64],
    ) -> Result<Self, SuspensionError> {
        let (suspended, suspension) = SuspendedMachine::of(machine)?;
        let actuators = suspension.linkages.len();
        let suspension = Suspension {
            control: control.clone(),
            ..suspension
        };
        if joint_positions.len() != machine.joints().len() {
            return Err(SuspensionError::Posture {
                expected: machine.joints().len(),
                found: joint_positions.len(),
            });
        }
        let independent = control.independent && actuators > 1;
        if independent && !suspended.carriers.apart {
            return Err(SuspensionError::Nested);
        }
        let mut optimiser = Self {
            settings: ProblemSettings {
                weights: Weights::of(machine, &control.weights)?,
                min_angle: control.min_stability_angle,
                look_ahead: (control.mode == ControlMode::LookAhead).then_some(control.look_ahead),
                limits: RodLimits::of(&suspension, 1.0 / control.rate),
            },
            independent,
            problem: if independent {
                Variables::Two(Box::new(Problem::new(&suspended)))
            } else {
                Variables::One(Box::new(Problem::new(&suspended)))
            },
            instant: Instant::new(&suspended),
            scratch: PredictedState::new(&suspended),
            finder: StepFinder::new(&suspended),
            suspended,
            reference: None,
            stopping: false,
        };
        if control.mode == ControlMode::OneStep {
            optimiser.check_step(joint_positions)?;
        }
        Ok(optimiser)
    }

    /// Duration of a step, for which a command applies (s).
    #[must_use]
    pub fn step_length(&self) -> f64 {
        self.settings.limits.step
    }

    /// Limits of the rods' motion.
    pub(crate) fn limits(&self) -> RodLimits {
        self.settings.limits
    }

    /// Width of the zone in front of a stop in which the velocity limit shrinks: eps (m).
    #[must_use]
    pub fn approach_zone(&self) -> f64 {
        self.settings.limits.zone
    }

    /// Smallest and largest velocity of a rod at a stroke (m, m/s): (31c).
    #[must_use]
    pub fn velocity_limits(&self, position: f64) -> [f64; 2] {
        self.settings.limits.velocity(position)
    }

    /// Smallest and largest acceleration of a rod at a stroke (m, m/s^2): (31d).
    #[must_use]
    pub fn acceleration_limits(&self, position: f64) -> [f64; 2] {
        self.settings.limits.acceleration(position)
    }

    /// Discards the history.
    pub fn reset(&mut self) {
        match &mut self.problem {
            Variables::One(problem) => problem.forget(),
            Variables::Two(problem) => problem.forget(),
        }
        self.reference = None;
        self.stopping = false;
    }

    /// The critical step of a machine at rest on level ground, its joints at these positions (rad or m) except for
    /// its rods, which are all at `rod` (m).
    pub fn critical_step(&mut self, joint_positions: &[f64], rod: f64) -> CriticalStep {
        let rods = [rod; MAX_ACTUATORS];
        let state = resting_state(&self.suspended.machine, joint_positions);
        self.level_instant(&state, &rods);
        self.find_step(&rods)
    }

    /// Fills the instant of a machine at rest with gravity along the normal of its contact plane.
    fn level_instant(&mut self, state: &State<f64>, rods: &[f64; MAX_ACTUATORS]) {
        let at_rest = rods.map(Motion::at_rest);
        let at_rest = &at_rest[..self.suspended.linkages.len()];
        let gravity = self.suspended.machine.gravity();
        self.instant
            .fill(&self.suspended, state, at_rest, &mut self.scratch);
        let up = nalgebra::Vector3::z();
        self.instant.on_ground.specific_force = up * gravity;
        self.instant.on_ground.angular_velocity.fill(0.0);
        self.instant.on_ground.angular_acceleration.fill(0.0);
        self.instant.up_on_ground = up;
    }

    fn find_step(&mut self, rods: &[f64; MAX_ACTUATORS]) -> CriticalStep {
        self.finder.find(
            &self.suspended,
            &self.instant,
            &rods[..self.suspended.linkages.len()],
            &self.settings.weights,
            self.independent,
        )
    }

    /// Checks that the step is long enough over the whole stroke.
    fn check_step(&mut self, joint_positions: &[f64]) -> Result<(), SuspensionError> {
        let [least, greatest] = self.settings.limits.stroke;
        let mut largest = (0.0, least);
        for k in 0..STROKE_POSITIONS {
            let share = k as f64 / (STROKE_POSITIONS - 1) as f64;
            let position = least + (greatest - least) * share;
            let found = self.critical_step(joint_positions, position);
            let Some(time) = found.time else {
                return Err(SuspensionError::NoCriticalStep {
                    position,
                    by_position: found.front_less_rear_by_position,
                    by_acceleration: found.front_less_rear_by_acceleration,
                });
            };
            if time > largest.0 {
                largest = (time, position);
            }
        }
        let (critical, position) = largest;
        if self.step_length() < STEP_FACTOR * critical {
            return Err(SuspensionError::StepTooShort {
                step: self.step_length(),
                least_step: STEP_FACTOR * critical,
                critical,
                position,
            });
        }
        Ok(())
    }

    /// Computes the next command from the machine's state and the strokes (m) and velocities (m/s) of the
    /// suspension's rods, in the order of its linkages.
    ///
    /// Suspension positions and velocities in the state are ignored, its accelerations are used. Stability angles
    /// require [`BaseState::up`](tipwatch_mechanics::BaseState).
    pub fn step(&mut self, state: &State<f64>, x: &[f64], v: &[f64]) -> Command {
        self.step_on(state, x, v, None)
    }

    /// Computes the step on a ground with this motion instead of the measured one, in the frame of the contact plane.
    pub(crate) fn step_on(
        &mut self,
        state: &State<f64>,
        x: &[f64],
        v: &[f64],
        ground: Option<&ImuState<f64>>,
    ) -> Command {
        let actuators = self.suspended.linkages.len();
        let known =
            |values: &[f64]| values.len() == actuators && values.iter().all(|u| u.is_finite());
        if !known(x) || !known(v) {
            return self.hold();
        }
        let allowed = |k: usize| self.settings.limits.allowed(x[k], v[k]);
        let mut rods = [Rod {
            x: 0.0,
            v: 0.0,
            allowed: Allowed {
                range: [0.0; 2],
                viable: true,
            },
        }; MAX_ACTUATORS];
        for (k, rod) in rods[..actuators].iter_mut().enumerate() {
            *rod = Rod {
                x: x[k],
                v: v[k],
                allowed: allowed(k),
            };
        }
        let rods = &rods[..actuators];
        if rods.iter().any(|rod| !rod.allowed.viable) {
            return self.stop(rods, Status::OutsideLimits);
        }
        if !self.fits(state) {
            return self.stop(rods, Status::NoSolution);
        }
        self.observe(state, rods);
        if let Some(ground) = ground {
            self.instant.on_ground = *ground;
        }
        let (suspended, instant, settings) = (&self.suspended, &self.instant, &self.settings);
        let solved = match &mut self.problem {
            Variables::One(problem) => problem.solve(suspended, instant, settings, rods),
            Variables::Two(problem) => problem.solve(suspended, instant, settings, rods),
        };
        let status = match solved.found.ending {
            Ending::Converged => Status::Optimal,
            Ending::WorkLimit => Status::WorkLimit,
            Ending::NoMargin => Status::MarginLost,
            Ending::NotFinite => return self.stop(rods, Status::NoSolution),
        };
        if !solved.has_right_sign {
            return self.stop(rods, Status::StepTooShort);
        }
        self.stopping = false;
        self.command(rods, solved.acceleration, status, Some(&solved))
    }

    /// Whether a state has the numbers of joints and payloads of this machine.
    pub(crate) fn fits(&self, state: &State<f64>) -> bool {
        state.joints.len() == self.suspended.machine.joints().len()
            && state.payload_share.len() == self.suspended.machine.payloads().len()
    }

    /// Fills the instant: the state without the motion of the suspension.
    fn observe(&mut self, state: &State<f64>, rods: &[Rod]) {
        let mut motions = self.suspended.rods(state);
        for (motion, rod) in motions.iter_mut().zip(rods) {
            (motion.position, motion.rate) = (rod.x, rod.v);
        }
        self.instant.fill(
            &self.suspended,
            state,
            &motions[..rods.len()],
            &mut self.scratch,
        );
    }

    /// The smoothest stop within the limits; outside of them, the hardest braking.
    fn stop(&mut self, rods: &[Rod], status: Status) -> Command {
        let dt = self.settings.limits.step;
        let braking = |k: usize| {
            let rod = rods.get(k);
            rod.map_or(0.0, |rod| clamp(-rod.v / dt, rod.allowed.range))
        };
        let holds = self.stopping && status == Status::NoSolution;
        self.stopping = status == Status::NoSolution;
        let mut command = self.command(rods, std::array::from_fn(braking), status, None);
        command.hold = holds;
        command
    }

    /// If the strokes are unknown, nothing may move.
    fn hold(&mut self) -> Command {
        self.stopping = true;
        let middle = 0.5 * (self.settings.limits.stroke[0] + self.settings.limits.stroke[1]);
        Command {
            position: self.reference.unwrap_or([middle; MAX_ACTUATORS]),
            hold: true,
            ..Command::blank(self.suspended.linkages.len(), Status::PositionUnknown)
        }
    }

    /// (31e), (31f) for these accelerations.
    fn command(
        &mut self,
        rods: &[Rod],
        acceleration: [f64; MAX_ACTUATORS],
        status: Status,
        solved: Option<&Solved>,
    ) -> Command {
        let limits = &self.settings.limits;
        let mut command = Command::blank(rods.len(), status);
        command.acceleration = acceleration;
        for (k, rod) in rods.iter().enumerate() {
            let v = rod.v + limits.step * acceleration[k];
            command.velocity[k] = v.clamp(-limits.max_velocity, limits.max_velocity);
            let x = rod.x + limits.step * command.velocity[k];
            command.position[k] = clamp(x, limits.stroke);
        }
        if let Some(solved) = solved {
            command.cost = solved.found.cost;
            command.target = solved.variable;
            command.iterations = solved.found.iterations;
            command.evaluations = solved.found.evaluations;
        }
        self.reference = Some(command.position);
        command
    }
}
