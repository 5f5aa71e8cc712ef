//! Simulates the rows with another rod motion.

use anyhow::{Result, anyhow};
use tipwatch_mechanics::machine::{Machine, Suspension};
use tipwatch_mechanics::{Motion, State};
use tipwatch_suspension::hydraulics::{Actuator, ActuatorInput, ActuatorState};
use tipwatch_suspension::{Command, Controller, MAX_ACTUATORS, Replay};

use super::mode::SuspensionMode;
use super::track::{Driven, Track};
use crate::analysis::Analysis;
use crate::base::rows::Rows;

/// Longest step between rows (s); beyond it the simulation restarts.
const LONGEST_ROW_S: f64 = 0.5;
/// Longest interval between valve commands (s).
const VALVE_STEP_S: f64 = 0.01;

/// Rod motion of a machine.
type Rods = [Motion<f64>; MAX_ACTUATORS];

/// Simulates locked rods, or rods as recorded.
pub(super) fn given(analysis: &Analysis, mode: SuspensionMode) -> Result<Track> {
    let (machine, rows) = (&analysis.machine, &analysis.rows);
    let mut replay = Replay::new(machine)?;
    let actuators = replay.actuators();
    let mut track = Track::new(machine, actuators);
    let mut state = State::zero(machine);
    let mut locked: Option<Rods> = None;
    for row in 0..rows.len() {
        rows.states.get(row, &mut state);
        let recorded = replay.rods(&state);
        if !usable(rows, row, &recorded[..actuators]) {
            track.push_unknown();
            continue;
        }
        let rods = match mode {
            SuspensionMode::Locked => *locked.get_or_insert(at_rest(&recorded)),
            _ => recorded,
        };
        replay.moved(&state, &rods[..actuators]);
        track.push(&replay, &rods, None, None);
    }
    Ok(track)
}

/// Whether a row has meaningful loads and known rods.
fn usable(rows: &Rows, row: usize, rods: &[Motion<f64>]) -> bool {
    rows.reasons[row].leave_loads() && rods.iter().all(|rod| rod.position.is_finite())
}

fn at_rest(rods: &Rods) -> Rods {
    rods.map(|rod| Motion {
        position: rod.position,
        ..Motion::zero()
    })
}

/// Simulates controlled rods, driven by valves and cylinders.
pub(super) fn controlled(analysis: &Analysis, suspension: &Suspension) -> Result<Track> {
    let (machine, rows) = (&analysis.machine, &analysis.rows);
    let posture = first_usable_posture(machine, rows)
        .ok_or_else(|| anyhow!("expected rows with known joints, found none"))?;
    let mut run = Run {
        replay: Replay::new(machine)?,
        controller: Controller::new(machine, &suspension.control, &posture)?,
        actuator: Actuator {
            parameters: suspension.hydraulics,
        },
        stroke: suspension.stroke,
        going: None,
    };
    let actuators = run.replay.actuators();
    let mut track = Track::new(machine, actuators);
    let mut state = State::zero(machine);
    for row in 0..rows.len() {
        rows.states.get(row, &mut state);
        let recorded = run.replay.rods(&state);
        if !usable(rows, row, &recorded[..actuators]) || !run.begin(&state, &recorded) {
            run.stop();
            track.push_unknown();
            continue;
        }
        run.tell(&state, &mut track);
        let next = rows.times_ns.get(row + 1).copied();
        let seconds = next.map_or(0.0, |next| (next - rows.times_ns[row]) as f64 * 1e-9);
        if seconds > LONGEST_ROW_S || !run.advance(&state, seconds) {
            run.stop();
        }
    }
    Ok(track)
}

/// Positions of the joints in the first usable row.
fn first_usable_posture(machine: &Machine, rows: &Rows) -> Option<Vec<f64>> {
    let mut state = State::zero(machine);
    (0..rows.len())
        .filter(|&row| rows.reasons[row].leave_loads())
        .find_map(|row| {
            rows.states.get(row, &mut state);
            let positions = state.joints.iter().map(|joint| joint.position);
            let posture: Vec<f64> = positions.collect();
            posture.iter().all(|p| p.is_finite()).then_some(posture)
        })
}

/// The simulation of the actuators and their control.
struct Run {
    replay: Replay,
    controller: Controller,
    actuator: Actuator,
    stroke: [f64; 2],
    going: Option<Going>,
}

/// Current state.
struct Going {
    cylinders: [ActuatorState; MAX_ACTUATORS],
    rods: Rods,
    command: Option<Command>,
    /// Time until the next command (s).
    due_s: f64,
}

impl Run {
    /// Starts at the recorded rods unless running; `false` if the actuator loads are unknown.
    fn begin(&mut self, state: &State<f64>, recorded: &Rods) -> bool {
        if self.going.is_some() {
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
            let (load, out) = match k < actuators {
                true => (self.replay.rod_force(k), rods[k].position - least),
                false => (0.0, 0.0),
            };
            self.actuator.at_rest(out, load)
        };
        let cylinders: [ActuatorState; MAX_ACTUATORS] = std::array::from_fn(at);
        let known = cylinders.iter().all(|c| c.pressures.piston.is_finite());
        self.going = known.then_some(Going {
            cylinders,
            rods,
            command: None,
            due_s: 0.0,
        });
        known
    }

    fn stop(&mut self) {
        self.going = None;
        self.controller.reset();
    }

    /// The recorded row.
    fn tell(&mut self, state: &State<f64>, track: &mut Track) {
        let Some(going) = &self.going else {
            return track.push_unknown();
        };
        let actuators = self.replay.actuators();
        self.replay.moved(state, &going.rods[..actuators]);
        let reference = self.controller.reference();
        let driven: [Driven; MAX_ACTUATORS] = std::array::from_fn(|k| {
            let (position, velocity) =
                reference.map_or((f64::NAN, f64::NAN), |(x, v)| (x[k], v[k]));
            Driven {
                reference: position,
                reference_velocity: velocity,
                commanded_acceleration: going.command.map_or(f64::NAN, |c| c.acceleration[k]),
                velocity_limits: self.controller.optimiser().velocity_limits(position),
                acceleration_limits: self.controller.optimiser().acceleration_limits(position),
                opening: self.controller.valve(k).opening(),
                pressures: going.cylinders[k].pressures,
                force: self.actuator.force(&going.cylinders[k]),
            }
        });
        let status = going.command.map(|command| command.status);
        track.push(&self.replay, &going.rods, Some(&driven), status);
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
        let Some(going) = &mut self.going else {
            return false;
        };
        let actuators = self.replay.actuators();
        let positions = going.rods.map(|rod| rod.position);
        if going.due_s <= 0.5 * seconds {
            let mut wanted = going.rods;
            if let Some((position, velocity)) = self.controller.reference() {
                for (k, rod) in wanted.iter_mut().enumerate() {
                    *rod = Motion {
                        position: position[k],
                        rate: velocity[k],
                        acceleration: 0.0,
                    };
                }
            }
            let seen = self.replay.moved(state, &wanted[..actuators]);
            going.command = Some(self.controller.tick(seen, &positions[..actuators]));
            going.due_s += self.controller.step_length();
        }
        going.due_s -= seconds;
        self.controller.follow(&positions[..actuators], seconds);
        let (mut forces, mut mass) = ([0.0; MAX_ACTUATORS], 0.0);
        for acceleration in [0.0, 1.0] {
            let rods = going.rods.map(|rod| Motion {
                acceleration,
                ..rod
            });
            self.replay.moved(state, &rods[..actuators]);
            for (k, force) in forces[..actuators].iter_mut().enumerate() {
                let needed = self.replay.rod_force(k);
                if acceleration == 0.0 {
                    *force = needed;
                } else {
                    mass += (needed - *force) / actuators as f64;
                }
            }
        }
        for k in 0..actuators {
            let drive = ActuatorInput::Load {
                force: forces[k],
                mass,
            };
            let (valve, before) = (self.controller.valve(k), &going.cylinders[k]);
            let Ok(after) = self.actuator.step(before, valve, drive, seconds) else {
                return false;
            };
            going.rods[k] = Motion {
                position: self.stroke[0] + after.out,
                rate: after.velocity,
                acceleration: (after.velocity - before.velocity) / seconds,
            };
            going.cylinders[k] = after;
        }
        true
    }
}
