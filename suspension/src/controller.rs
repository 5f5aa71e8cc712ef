//! Stabiliser and valve law together: what runs onboard.
//!
//! The stabiliser moves a reference; the valves follow it, (36). The reference is its own state, not the measured
//! rods: a proportional law moves only where there is an error to follow. It begins at the measured rods, and begins there
//! again where they are left too far behind.

use crate::command::{Command, Status};
use crate::error::StabiliserError;
use crate::hydraulics::Valve;
use crate::stabiliser::Stabiliser;
use crate::suspended_machine::MAX_ACTUATORS;
use tipwatch_mechanics::machine::{HydraulicParameters, Machine, SuspensionControl};
use tipwatch_mechanics::state::State;

/// A rod that is this share of the stroke from its reference has not followed it.
const LOST_SHARE: f64 = 0.25;

/// Steers the suspension tick by tick. A tick allocates nothing and its work is bounded.
#[derive(Debug)]
pub struct Controller {
    stabiliser: Stabiliser,
    hydraulics: HydraulicParameters,
    stroke: [f64; 2],
    reference: Option<Reference>,
    valves: [Valve; MAX_ACTUATORS],
}

/// Where the rods should be now, and are going.
#[derive(Debug, Clone, Copy)]
struct Reference {
    position: [f64; MAX_ACTUATORS],
    velocity: [f64; MAX_ACTUATORS],
    end: [f64; MAX_ACTUATORS],
    hold: bool,
}

impl Controller {
    /// See [`Stabiliser::new`].
    ///
    /// # Errors
    /// [`StabiliserError`]: the machine has no suspension that can be steered so.
    pub fn new(
        machine: &Machine,
        control: &SuspensionControl,
        joint_positions: &[f64],
    ) -> Result<Self, StabiliserError> {
        let Some(suspension) = machine.suspension() else {
            return Err(StabiliserError::NoSuspension);
        };
        Ok(Self {
            stabiliser: Stabiliser::new(machine, control, joint_positions)?,
            hydraulics: suspension.hydraulics,
            stroke: suspension.stroke,
            reference: None,
            valves: [Valve::closed(); MAX_ACTUATORS],
        })
    }

    /// How often [`Self::tick`] is due (s).
    #[must_use]
    pub fn step_length(&self) -> f64 {
        self.stabiliser.step_length()
    }

    /// The stabiliser.
    #[must_use]
    pub fn stabiliser(&self) -> &Stabiliser {
        &self.stabiliser
    }

    /// Forgets the ticks before and closes the valves.
    pub fn reset(&mut self) {
        self.stabiliser.reset();
        self.reference = None;
        self.valves = [Valve::closed(); MAX_ACTUATORS];
    }

    /// Where the rods should be and how fast they should go (m, m/s), by actuator; `None` before the first
    /// tick.
    #[must_use]
    pub fn reference(&self) -> Option<([f64; MAX_ACTUATORS], [f64; MAX_ACTUATORS])> {
        self.reference.map(|r| (r.position, r.velocity))
    }

    /// The next command, from the machine's state and the measured positions of the rods (m), in the order of
    /// the suspension's linkages: once a step. Whatever the input, it is within the limits and says in its
    /// [`Status`] how it was found.
    pub fn tick(&mut self, state: &State<f64>, measured: &[f64]) -> Command {
        let known = measured.len() <= MAX_ACTUATORS && measured.iter().all(|x| x.is_finite());
        if !known {
            let command = self
                .stabiliser
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
        let command = self.stabiliser.step(state, &position[..n], &velocity[..n]);
        self.reference = Some(Reference {
            position,
            velocity: command.velocity,
            end: command.position,
            hold: command.hold || command.status == Status::PositionUnknown,
        });
        command
    }

    /// Moves the reference on by so many seconds, and the valves after it: H(6). Gives their openings, -1 to 1,
    /// positive where the rod is to go out. Where a position is unknown, and where the command is to hold,
    /// they close.
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

    /// The valve of an actuator as it is.
    #[must_use]
    pub fn valve(&self, actuator: usize) -> Valve {
        self.valves[actuator]
    }
}
