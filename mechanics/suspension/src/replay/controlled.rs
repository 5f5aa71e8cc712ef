//! Rods on their oil: the controller or closed valves, and the cylinders, simulated along the recorded states.

use tipwatch_mechanics::geometry::coordinate::Motion;
use tipwatch_mechanics::machine::{Machine, Suspension, SuspensionControl};
use tipwatch_mechanics::state::State;

use super::moved_state::{Replay, Rods, at_rest};
use super::recorded::RecordedRows;
use super::track::{ActuatorRow, Track};
use crate::condensed::MAX_ACTUATORS;
use crate::control::{Command, Controller};
use crate::error::SuspensionError;
use crate::hydraulics::{Actuator, ActuatorInput, ActuatorState};

/// Longest interval between rows (s); beyond it the simulation restarts.
const MAX_ROW_INTERVAL_S: f64 = 0.5;
/// Longest interval between valve commands (s).
const VALVE_STEP_S: f64 = 0.01;

/// Rods moved by a control.
pub(super) fn controlled(
    machine: &Machine,
    rows: RecordedRows<'_>,
    suspension: &Suspension,
    control: &SuspensionControl,
) -> Result<Track, SuspensionError> {
    simulated(machine, rows, suspension, control, false)
}

/// Replays the rods on cylinders whose valves stay closed: locked, but for the compliance of the oil.
pub(super) fn held(
    machine: &Machine,
    rows: RecordedRows<'_>,
    suspension: &Suspension,
) -> Result<Track, SuspensionError> {
    simulated(
        machine,
        rows,
        suspension,
        &SuspensionControl::default(),
        true,
    )
}

fn simulated(
    machine: &Machine,
    rows: RecordedRows<'_>,
    suspension: &Suspension,
    control: &SuspensionControl,
    stays_closed: bool,
) -> Result<Track, SuspensionError> {
    let posture = rows
        .first_posture(machine)
        .ok_or(SuspensionError::NoPosture)?;
    let mut simulation = Simulation {
        replay: Replay::new(machine)?,
        controller: Controller::new(machine, control, &posture)?,
        actuator: Actuator {
            parameters: suspension.hydraulics,
        },
        stroke: suspension.stroke,
        stays_closed,
        running: None,
    };
    let mut track = Track::new(machine, simulation.replay.actuators());
    let mut state = State::zero(machine);
    for row in 0..rows.len() {
        rows.states.get(row, &mut state);
        let recorded = simulation.replay.rods(&state);
        if !rows.is_usable(row, &recorded) || !simulation.begin(&state, &recorded) {
            simulation.stop();
            track.push_unknown();
            continue;
        }
        simulation.record(&state, &mut track);
        let next = rows.times_ns.get(row + 1).copied();
        let seconds = next.map_or(0.0, |next| (next - rows.times_ns[row]) as f64 * 1e-9);
        if seconds > MAX_ROW_INTERVAL_S || !simulation.advance(&state, seconds) {
            simulation.stop();
        }
    }
    Ok(track)
}

/// The simulation of the actuators and their control.
struct Simulation {
    replay: Replay,
    controller: Controller,
    actuator: Actuator,
    stroke: [f64; 2],
    /// Whether the valves never open.
    stays_closed: bool,
    running: Option<Running>,
}

/// State of a running simulation.
struct Running {
    cylinders: [ActuatorState; MAX_ACTUATORS],
    rods: Rods,
    command: Option<Command>,
    /// Time until the next command (s).
    due_s: f64,
}

impl Simulation {
    /// Starts at the recorded rods unless running; `false` if the actuator loads are unknown.
    fn begin(&mut self, state: &State<f64>, recorded: &Rods) -> bool {
        if self.running.is_some() {
            return true;
        }
        let [least, greatest] = self.stroke;
        let rods = at_rest(recorded).map(|rod| Motion {
            position: rod.position.clamp(least, greatest),
            ..rod
        });
        let actuators = self.replay.actuators();
        self.replay.moved(state, &rods[..actuators]);
        let at = |k: usize| {
            let (load, extension) = match k < actuators {
                true => (self.replay.rod_force(k), rods[k].position - least),
                false => (0.0, 0.0),
            };
            self.actuator.at_rest(extension, load)
        };
        let cylinders: [ActuatorState; MAX_ACTUATORS] = std::array::from_fn(at);
        let known = cylinders.iter().all(|c| c.pressures.piston.is_finite());
        self.running = known.then_some(Running {
            cylinders,
            rods,
            command: None,
            due_s: 0.0,
        });
        known
    }

    fn stop(&mut self) {
        self.running = None;
        self.controller.reset();
    }

    /// Records the present state of the actuators.
    fn record(&mut self, state: &State<f64>, track: &mut Track) {
        let Some(running) = &self.running else {
            return track.push_unknown();
        };
        let actuators = self.replay.actuators();
        self.replay.moved(state, &running.rods[..actuators]);
        let reference = self.controller.reference();
        let by_actuator: [ActuatorRow; MAX_ACTUATORS] = std::array::from_fn(|k| {
            let (position, velocity) =
                reference.map_or((f64::NAN, f64::NAN), |(x, v)| (x[k], v[k]));
            ActuatorRow {
                reference: position,
                reference_velocity: velocity,
                commanded_acceleration: running.command.map_or(f64::NAN, |c| c.acceleration[k]),
                velocity_limits: self.controller.optimiser().velocity_limits(position),
                acceleration_limits: self.controller.optimiser().acceleration_limits(position),
                opening: self.controller.valve(k).opening(),
                pressures: running.cylinders[k].pressures,
                force: self.actuator.force(&running.cylinders[k]),
            }
        });
        let status = running.command.map(|command| command.status);
        track.push(&self.replay, &running.rods, Some(&by_actuator), status);
    }

    /// Advances by some seconds with the recorded state held; `false` if that cannot be computed.
    fn advance(&mut self, state: &State<f64>, seconds: f64) -> bool {
        if seconds <= 0.0 {
            return true;
        }
        let longest = self.controller.step_length().min(VALVE_STEP_S);
        let steps = (seconds / longest - 1e-6).ceil().max(1.0);
        let step = seconds / steps;
        (0..steps as usize).all(|_| self.step(state, step))
    }

    fn step(&mut self, state: &State<f64>, seconds: f64) -> bool {
        let Some(running) = &mut self.running else {
            return false;
        };
        let actuators = self.replay.actuators();
        let positions = running.rods.map(|rod| rod.position);
        if !self.stays_closed && running.due_s <= 0.5 * seconds {
            let mut wanted = running.rods;
            if let Some((position, velocity)) = self.controller.reference() {
                for (k, rod) in wanted.iter_mut().enumerate() {
                    *rod = Motion {
                        position: position[k],
                        rate: velocity[k],
                        acceleration: 0.0,
                    };
                }
            }
            let expected = self.replay.moved(state, &wanted[..actuators]);
            running.command = Some(self.controller.tick(expected, &positions[..actuators]));
            running.due_s += self.controller.step_length();
        }
        running.due_s -= seconds;
        let pistons = running
            .cylinders
            .map(|cylinder| self.actuator.force(&cylinder));
        let known = self.replay.carried(state, &running.rods, &pistons);
        let rods = running.rods.map(|rod| Motion {
            acceleration: 1.0,
            ..rod
        });
        self.replay.moved(state, &rods[..actuators]);
        let moved = (0..actuators).map(|k| self.replay.rod_force(k) - known[k].load);
        let mass = moved.sum::<f64>() / actuators as f64;
        self.controller
            .follow_loaded(&positions[..actuators], &known[..actuators], seconds);
        for k in 0..actuators {
            let input = ActuatorInput::Load {
                force: known[k].load,
                mass,
            };
            let (valve, before) = (self.controller.valve(k), &running.cylinders[k]);
            let Ok(after) = self.actuator.step(before, valve, input, seconds) else {
                return false;
            };
            running.rods[k] = Motion {
                position: self.stroke[0] + after.extension,
                rate: after.velocity,
                acceleration: (after.velocity - before.velocity) / seconds,
            };
            running.cylinders[k] = after;
        }
        true
    }
}
