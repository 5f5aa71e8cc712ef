//! The onboard controller: suspension optimiser and valve law combined.
//!
//! The optimiser moves a reference that the valves follow, (36). The reference is a state of its own, not the
//! measured rod position, because a proportional law needs a position error to move. It starts at the measured
//! rods and is reset to them when they fall too far behind.

use super::command::{Command, Status};
use super::optimiser::SuspensionOptimiser;
use crate::condensed::MAX_ACTUATORS;
use crate::error::SuspensionError;
use crate::hydraulics::Valve;
use tipwatch_mechanics::machine::{HydraulicParameters, Machine, SuspensionControl};
use tipwatch_mechanics::state::State;

/// Position error, as a fraction of the stroke, beyond which the reference is reset.
const LOST_SHARE: f64 = 0.25;

/// Controls the suspension tick by tick. A tick does not allocate and its work is bounded.
#[derive(Debug)]
pub struct Controller {
    optimiser: SuspensionOptimiser,
    hydraulics: HydraulicParameters,
    stroke: [f64; 2],
    reference: Option<Reference>,
    valves: [Valve; MAX_ACTUATORS],
}

/// Reference position and motion of the rods.
#[derive(Debug, Clone, Copy)]
struct Reference {
    position: [f64; MAX_ACTUATORS],
    velocity: [f64; MAX_ACTUATORS],
    end: [f64; MAX_ACTUATORS],
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
        let Some(suspension) = machine.suspension() else {
            return Err(SuspensionError::NoSuspension);
        };
        Ok(Self {
            optimiser: SuspensionOptimiser::new(machine, control, joint_positions)?,
            hydraulics: suspension.hydraulics,
            stroke: suspension.stroke,
            reference: None,
            valves: [Valve::closed(); MAX_ACTUATORS],
        })
    }

    /// Period of [`Self::tick`] (s).
    #[must_use]
    pub fn step_length(&self) -> f64 {
        self.optimiser.step_length()
    }

    /// The suspension optimiser.
    #[must_use]
    pub fn optimiser(&self) -> &SuspensionOptimiser {
        &self.optimiser
    }

    /// Discards the history and closes the valves.
    pub fn reset(&mut self) {
        self.optimiser.reset();
        self.reference = None;
        self.valves = [Valve::closed(); MAX_ACTUATORS];
    }

    /// Reference position and velocity of the rods (m, m/s), by actuator; `None` before the first tick.
    #[must_use]
    pub fn reference(&self) -> Option<([f64; MAX_ACTUATORS], [f64; MAX_ACTUATORS])> {
        self.reference.map(|r| (r.position, r.velocity))
    }

    /// Computes the next command from the machine's state and the measured strokes (m), in the order of the
    /// suspension's linkages; to be called once per step. For any input the command is within the limits, and its
    /// [`Status`] says how it was found.
    pub fn tick(&mut self, state: &State<f64>, measured: &[f64]) -> Command {
        let known = measured.len() <= MAX_ACTUATORS && measured.iter().all(|x| x.is_finite());
        if !known {
            let command = self
                .optimiser
                .step(state, &[f64::NAN; MAX_ACTUATORS], measured);
            if let Some(reference) = &mut self.reference {
                reference.hold = true;
            }
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
            if follows && !before.hold {
                (position, velocity) = (before.position, before.velocity);
            }
        }
        let n = measured.len();
        let command = self.optimiser.step(state, &position[..n], &velocity[..n]);
        self.reference = Some(Reference {
            position,
            velocity: command.velocity,
            end: command.position,
            hold: command.hold || command.status == Status::PositionUnknown,
        });
        command
    }

    /// Advances the reference by `seconds` and updates the valves: H(6). Returns the valve commands, -1 to 1,
    /// positive to extend the rod. The valves close where a position is unknown and where the command is to hold.
    pub fn follow(&mut self, measured: &[f64], seconds: f64) -> [f64; MAX_ACTUATORS] {
        let mut openings = [0.0; MAX_ACTUATORS];
        for (k, valve) in self.valves.iter_mut().enumerate() {
            let found = measured.get(k).copied().unwrap_or(f64::NAN);
            let wanted = match &mut self.reference {
                Some(reference) if !reference.hold => {
                    let [from, end] = [reference.position[k], reference.end[k]];
                    let step = reference.velocity[k] * seconds.max(0.0);
                    let reached = (end - from) * step <= 0.0 || step.abs() >= (end - from).abs();
                    reference.position[k] = if reached { end } else { from + step };
                    reference.position[k]
                }
                _ => f64::NAN,
            };
            *valve = valve.follow(&self.hydraulics, wanted, found, seconds);
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
