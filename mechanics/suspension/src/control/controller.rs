//! The onboard controller: suspension optimiser, load guard and valve law combined.
//!
//! The optimiser chooses where the rods should be, the guard how they may get there, and the valves follow that
//! reference, (36). The reference is a state of its own, not the measured rod position: it starts at the measured
//! rods and is reset to them when they fall too far behind.

use super::command::{Command, Status};
use super::optimiser::SuspensionOptimiser;
use super::rod_watch::{RodFault, RodWatch, TRIAL_OPENING};
use crate::condensed::{MAX_ACTUATORS, SuspendedMachine};
use crate::error::SuspensionError;
use crate::guard::{LoadGuard, Move};
use crate::hydraulics::{Valve, ValveInput, full_velocity};
use crate::problem::{RodLimits, clamp};
use tipwatch_mechanics::machine::{ControlMode, HydraulicParameters, Machine, SuspensionControl};
use tipwatch_mechanics::state::{ImuState, State};

/// Position error, as a fraction of the stroke, beyond which the reference is reset.
const LOST_SHARE: f64 = 0.25;
/// Distance of a measured rod outside its stroke, as a fraction of the stroke, from which the measurement is wrong.
const STROKE_TOLERANCE: f64 = 0.05;
/// Longest time for which the reference goes on without a new command before it brakes (s).
const MAX_COAST_S: f64 = 0.1;
/// Largest velocity of the reference during a trial, as a share of the velocity that the trial opening gives without load.
const TRIAL_SHARE: f64 = 0.8;
/// The longest period of the guard (s).
const MAX_TICK_S: f64 = 0.02;

/// Controls the suspension tick by tick. A tick does not allocate and its work is bounded.
#[derive(Debug)]
pub struct Controller {
    optimiser: SuspensionOptimiser,
    guard: LoadGuard,
    limits: RodLimits,
    mode: ControlMode,
    hydraulics: HydraulicParameters,
    stroke: [f64; 2],
    actuators: usize,
    reference: Option<Reference>,
    /// The optimiser's last command, and the time until the next one (s).
    plan: Option<Command>,
    due_s: f64,
    /// Consecutive ticks without a solution.
    unsolved: u32,
    valves: [Valve; MAX_ACTUATORS],
    watches: [RodWatch; MAX_ACTUATORS],
}

/// Forces on a rod, positive to extend (N); NaN if unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RodForce {
    /// Of the piston, from measured pressures.
    pub piston: f64,
    /// Load on the rod without acceleration of the rods, from the model.
    pub load: f64,
}

impl RodForce {
    /// Forces that are both unknown.
    pub const UNKNOWN: Self = Self {
        piston: f64::NAN,
        load: f64::NAN,
    };
}

/// Reference position and motion of the rods.
#[derive(Debug, Clone, Copy)]
struct Reference {
    position: [f64; MAX_ACTUATORS],
    velocity: [f64; MAX_ACTUATORS],
    acceleration: [f64; MAX_ACTUATORS],
    /// Time for which the acceleration applies (s).
    left_s: f64,
    /// Time for which the velocity stays after that (s): rows may be slower than the guard.
    coast_s: f64,
    hold: bool,
}

impl Controller {
    /// See [`SuspensionOptimiser::new`].
    ///
    /// # Errors
    /// [`SuspensionError`]: the machine has no suspension that can be controlled like this.
    pub fn new(
        machine: &Machine,
        control: &SuspensionControl,
        joint_positions: &[f64],
    ) -> Result<Self, SuspensionError> {
        let optimiser = SuspensionOptimiser::new(machine, control, joint_positions)?;
        let (suspended, suspension) = SuspendedMachine::of(machine)?;
        let limits = RodLimits {
            step: optimiser.step_length().min(MAX_TICK_S),
            ..optimiser.limits()
        };
        let (look_ahead, min_angle) = (control.look_ahead, control.min_stability_angle);
        Ok(Self {
            guard: LoadGuard::new(&suspended, limits, look_ahead, min_angle),
            optimiser,
            limits,
            mode: control.mode,
            hydraulics: suspension.hydraulics,
            stroke: suspension.stroke,
            actuators: suspension.linkages.len(),
            reference: None,
            plan: None,
            due_s: 0.0,
            unsolved: 0,
            valves: [Valve::closed(); MAX_ACTUATORS],
            watches: [RodWatch::NEW; MAX_ACTUATORS],
        })
    }

    /// Period of [`Self::tick`] (s): that of the optimiser, at most 20 ms.
    #[must_use]
    pub fn step_length(&self) -> f64 {
        self.limits.step
    }

    /// The suspension optimiser.
    #[must_use]
    pub fn optimiser(&self) -> &SuspensionOptimiser {
        &self.optimiser
    }

    /// Discards the history and closes the valves. What is known of the rods' obedience is kept.
    pub fn reset(&mut self) {
        self.optimiser.reset();
        self.guard.reset();
        self.reference = None;
        self.plan = None;
        self.due_s = 0.0;
        self.unsolved = 0;
        self.valves = [Valve::closed(); MAX_ACTUATORS];
    }

    /// Reference position and velocity of the rods (m, m/s), by actuator; `None` before the first tick.
    #[must_use]
    pub fn reference(&self) -> Option<([f64; MAX_ACTUATORS], [f64; MAX_ACTUATORS])> {
        self.reference.map(|r| (r.position, r.velocity))
    }

    /// The first rod that does not obey its valve, and how; it stays until [`Self::trust_rods`].
    #[must_use]
    pub fn rod_fault(&self) -> Option<(usize, RodFault)> {
        let watches = self.watches.iter().enumerate();
        watches
            .filter_map(|(rod, watch)| Some((rod, watch.fault()?)))
            .next()
    }

    /// Clears the faults of the rods. Each must prove its direction again.
    pub fn trust_rods(&mut self) {
        self.watches = [RodWatch::NEW; MAX_ACTUATORS];
    }

    /// Whether measured strokes are within the stroke of the machine file, up to 5 % of it.
    #[must_use]
    pub fn is_plausible(&self, measured: &[f64]) -> bool {
        let tolerance = STROKE_TOLERANCE * (self.stroke[1] - self.stroke[0]);
        let range = self.stroke[0] - tolerance..=self.stroke[1] + tolerance;
        measured.iter().all(|x| range.contains(x))
    }

    /// Computes the next command from the machine's state and the measured strokes (m), in the order of the
    /// suspension's linkages; to be called once per [`Self::step_length`]. For any input the command is within the
    /// limits, and its [`Status`] says how it was found.
    pub fn tick(&mut self, state: &State<f64>, measured: &[f64]) -> Command {
        let unknown = [f64::NAN; MAX_ACTUATORS];
        let known = measured.len() == self.actuators && measured.iter().all(|x| x.is_finite());
        if !known || !self.is_plausible(measured) {
            let mut command = self.optimiser.step(state, &unknown, measured);
            if known {
                command.status = Status::PositionImplausible;
            }
            self.hold();
            return command;
        }
        if self.rod_fault().is_some() {
            let mut command = self.optimiser.step(state, &unknown, measured);
            command.status = Status::NotFollowing;
            self.hold();
            return command;
        }
        let mut position = [0.0; MAX_ACTUATORS];
        for (position, x) in position.iter_mut().zip(measured) {
            *position = x.clamp(self.stroke[0], self.stroke[1]);
        }
        let mut velocity = [0.0; MAX_ACTUATORS];
        let lost = LOST_SHARE * (self.stroke[1] - self.stroke[0]);
        if let Some(before) = &self.reference {
            let mut pairs = before.position.iter().zip(measured);
            let follows = pairs.all(|(wanted, found)| (wanted - found).abs() <= lost);
            if before.hold {
                // locked is where the rods are when control takes over
                self.guard.reset();
            } else if follows {
                (position, velocity) = (before.position, before.velocity);
            }
        }
        let n = self.actuators;
        let fits = self.optimiser.fits(state);
        let ground = fits.then(|| self.guard.observe(state, &position[..n], &velocity[..n]));
        let plan = self.plan(state, &position[..n], &velocity[..n], ground.as_ref());
        let command = self.guarded(state, plan, &position, &velocity);
        self.reference = Some(Reference {
            position,
            velocity,
            acceleration: command.acceleration,
            left_s: self.limits.step,
            coast_s: MAX_COAST_S,
            hold: command.hold,
        });
        command
    }

    /// Holds until the next [`Self::tick`]: [`Self::follow`] closes the valves.
    pub fn hold(&mut self) {
        self.plan = None;
        if let Some(reference) = &mut self.reference {
            reference.hold = true;
        }
    }

    /// The optimiser's command on a ground that moves like this, a new one if it is due.
    fn plan(
        &mut self,
        state: &State<f64>,
        x: &[f64],
        v: &[f64],
        ground: Option<&ImuState<f64>>,
    ) -> Command {
        let tick = self.limits.step;
        let plan = match self.plan {
            Some(plan) if ground.is_some() && self.due_s > 0.5 * tick => plan,
            _ => {
                let period = self.optimiser.step_length();
                self.due_s = (self.due_s + period).clamp(0.0, period);
                self.optimiser.step_on(state, x, v, ground)
            }
        };
        self.due_s -= tick;
        self.plan = Some(plan);
        plan
    }

    /// Returns the largest velocity of the reference (m/s): during a trial one that the trial opening can follow, so that no rod
    /// lags behind and jumps at its end.
    fn max_velocity(&self) -> f64 {
        if self.watches[..self.actuators]
            .iter()
            .all(RodWatch::is_proven)
        {
            return self.limits.max_velocity;
        }
        let [extending, retracting] =
            [1.0, -1.0].map(|direction| full_velocity(&self.hydraulics, 0.0, direction));
        let slowest = TRIAL_SHARE * TRIAL_OPENING * extending.min(retracting);
        slowest.min(self.limits.max_velocity)
    }

    /// The plan as far as every wheel can afford it.
    fn guarded(
        &mut self,
        state: &State<f64>,
        plan: Command,
        position: &[f64; MAX_ACTUATORS],
        velocity: &[f64; MAX_ACTUATORS],
    ) -> Command {
        let n = self.actuators;
        let wanted = match plan.status {
            Status::NoSolution | Status::OutsideLimits => None,
            Status::StepTooShort => Some(Move::Stop),
            _ if self.mode == ControlMode::LookAhead => Some(Move::To(plan.target)),
            _ => Some(Move::To(plan.position)),
        };
        let (x, v) = (&position[..n], &velocity[..n]);
        let max_velocity = self.max_velocity();
        let guard = &mut self.guard;
        let guarded = wanted.and_then(|wanted| guard.restrain(state, x, v, wanted, max_velocity));
        let mut command = plan;
        match guarded {
            Some(guarded) => {
                self.unsolved = 0;
                command.acceleration = guarded.acceleration;
                if guarded.is_restrained && command.status < Status::Restrained {
                    command.status = Status::Restrained;
                }
            }
            None => {
                for k in 0..n {
                    let allowed = self.limits.allowed(x[k], v[k]);
                    command.acceleration[k] = clamp(-v[k] / self.limits.step, allowed.range);
                }
                self.guard.overruled(command.acceleration);
                if command.status != Status::OutsideLimits {
                    command.status = Status::NoSolution;
                    self.unsolved = self.unsolved.saturating_add(1);
                    command.hold = self.unsolved > 1;
                    // ask again at once
                    self.plan = None;
                }
            }
        }
        let (step, most) = (self.limits.step, self.limits.max_velocity);
        for k in 0..n {
            let end = (v[k] + step * command.acceleration[k]).clamp(-most, most);
            command.velocity[k] = end;
            command.position[k] = clamp(x[k] + 0.5 * step * (v[k] + end), self.stroke);
        }
        command
    }

    /// Advances the reference by `seconds` and updates the valves without measured pressures: see
    /// [`Self::follow_loaded`].
    pub fn follow(&mut self, measured: &[f64], seconds: f64) -> [f64; MAX_ACTUATORS] {
        self.follow_loaded(measured, &[RodForce::UNKNOWN; MAX_ACTUATORS], seconds)
    }

    /// Advances the reference by `seconds` and updates the valves: H(6). Returns the valve commands, -1 to 1, positive
    /// to extend the rod. The valves close where a position is unknown, where a rod does not obey, and where the command
    /// is to hold. Until a rod has proven its direction, its valve opens no further than
    /// [`TRIAL_OPENING`](crate::TRIAL_OPENING).
    pub fn follow_loaded(
        &mut self,
        measured: &[f64],
        forces: &[RodForce],
        seconds: f64,
    ) -> [f64; MAX_ACTUATORS] {
        let seconds = seconds.max(0.0);
        let at = |values: &[f64], k: usize| values.get(k).copied().unwrap_or(f64::NAN);
        for k in 0..self.actuators {
            self.watches[k].see(seconds, self.valves[k].opening(), at(measured, k));
        }
        let may_move = self.rod_fault().is_none() && self.is_plausible(measured);
        if let Some(reference) = &mut self.reference {
            reference.advance(&self.limits, seconds);
        }
        let mut openings = [0.0; MAX_ACTUATORS];
        for (k, valve) in self.valves.iter_mut().enumerate() {
            let found = at(measured, k);
            let force = forces.get(k).copied().unwrap_or(RodForce::UNKNOWN);
            let (wanted, velocity) = match &self.reference {
                Some(reference) if !reference.hold && may_move => {
                    (reference.position[k], reference.velocity[k])
                }
                _ => (f64::NAN, 0.0),
            };
            let input = ValveInput {
                wanted,
                velocity,
                found,
                extension: found - self.stroke[0],
                force: force.piston,
                load: force.load,
                max_opening: self.watches[k].max_opening(),
            };
            *valve = valve.steer(&self.hydraulics, &input, seconds);
            openings[k] = valve.opening();
        }
        openings
    }

    /// Present state of an actuator's valve.
    #[must_use]
    pub fn valve(&self, actuator: usize) -> Valve {
        self.valves[actuator]
    }
}

impl Reference {
    /// Moves on; without a new command in time it brakes.
    fn advance(&mut self, limits: &RodLimits, seconds: f64) {
        let during = seconds.min(self.left_s);
        self.left_s -= during;
        let coasting = (seconds - during).min(self.coast_s);
        self.coast_s -= coasting;
        let late = seconds - during - coasting;
        for k in 0..MAX_ACTUATORS {
            let most = limits.max_velocity;
            let v = self.velocity[k];
            let end = (v + during * self.acceleration[k]).clamp(-most, most);
            let mut x = self.position[k] + 0.5 * during * (v + end) + coasting * end;
            let braking = limits.max_acceleration * late;
            let rest = end - end.clamp(-braking, braking);
            x += 0.5 * late * (end + rest);
            self.position[k] = clamp(x, limits.stroke);
            self.velocity[k] = rest;
        }
    }
}
