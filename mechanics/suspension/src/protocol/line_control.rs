//! The controller of one client: lines in, lines out, checked like samples onboard.

use nalgebra::Vector3;
use tipwatch_mechanics::estimation::plausibility::Plausibility;
use tipwatch_mechanics::geometry::coordinate::Motion;
use tipwatch_mechanics::machine::{HydraulicParameters, Machine, SuspensionControl};
use tipwatch_mechanics::state::{JointStream, Sample, Sensor, Sensors, State, UNIT_TOLERANCE};
use tipwatch_mechanics::verdict::limits::GOOD_ROWS;

use super::message::{Answer, Number, Opening, ProtocolError, Ready, Request, VERSION};
use crate::condensed::MAX_ACTUATORS;
use crate::control::{Command, Controller, RodFault, Status};
use crate::error::SuspensionError;
use crate::hydraulics::{Pressures, piston_force};
use crate::replay::Replay;

/// Longest time for which a command counts without the next one, and longest time between states (s).
const VALID_S: f64 = 0.1;
/// Reasons to hold, named as onboard where they exist there.
const INPUT: &str = "input";
const ROW_INVALID: &str = "row_invalid";
const OUTSIDE_STROKE: &str = "outside_stroke";
const LATE: &str = "late";
const REPEATED: &str = "repeated";
const STARTING: &str = "starting";
const ENDED: &str = "ended";
/// Largest difference between the position of a rod's joint and the rod's stroke (m).
const ROD_TOLERANCE_M: f64 = 5e-3;

/// Answers the lines of one client.
#[derive(Debug)]
pub struct LineControl<'a> {
    machine: &'a Machine,
    actuators: usize,
    controller: Controller,
    hydraulics: HydraulicParameters,
    replay: Replay,
    state: State<f64>,
    /// Measured force of each piston (N); NaN if unknown.
    pistons: [f64; MAX_ACTUATORS],
    checks: Plausibility,
    /// Time of the present state by the client (s), if the client states it, and that of the state before.
    time_s: Number,
    before_s: Number,
    /// Time of the present state since the first line (s).
    since_s: f64,
    /// The last command of the controller, and the time until the next one (s).
    command: Option<Command>,
    due_s: f64,
    /// Good states in a row that must still come before the valves follow.
    needed: u32,
    /// Positions and velocities of the joints, and the values of the IMU, as samples.
    joints: Vec<f64>,
    imu: [f64; 10],
}

impl<'a> LineControl<'a> {
    /// Starts with the first line.
    ///
    /// # Errors
    /// The first line lacks a joint, or the machine has no suspension that can be controlled like this.
    pub fn new(
        machine: &'a Machine,
        opening: &Opening,
        control: &SuspensionControl,
    ) -> Result<(Self, Ready), ProtocolError> {
        let suspension = machine.suspension().ok_or(SuspensionError::NoSuspension)?;
        let controller = Controller::new(machine, control, &opening.posture(machine)?)?;
        let linkages = suspension.linkages.iter();
        let ready = Ready {
            protocol: VERSION,
            rods: linkages
                .map(|&linkage| machine.linkages()[linkage].name.clone())
                .collect(),
            step_s: controller.step_length(),
            stroke_m: suspension.stroke,
            valid_s: VALID_S,
        };
        let line_control = Self {
            machine,
            actuators: suspension.linkages.len(),
            controller,
            hydraulics: suspension.hydraulics,
            replay: Replay::new(machine)?,
            state: State::zero(machine),
            pistons: [f64::NAN; MAX_ACTUATORS],
            checks: Plausibility::new(
                machine,
                &Sensors {
                    joints: vec![JointStream {
                        joints: (0..machine.joints().len()).collect(),
                    }],
                    imu: true,
                    ..Sensors::default()
                },
            ),
            time_s: None,
            before_s: None,
            since_s: 0.0,
            command: None,
            due_s: 0.0,
            needed: 0,
            joints: Vec::new(),
            imu: [f64::NAN; 10],
        };
        Ok((line_control, ready))
    }

    /// Computes the command for a line with a state.
    pub fn answer(&mut self, line: &str) -> Answer {
        match self.read(line) {
            Ok(rods) => self.command(&rods),
            Err(error) => self.refuse(error.to_string()),
        }
    }

    /// The answer to a line that is not a state, because of this error: the valves close.
    pub fn refuse(&mut self, error: String) -> Answer {
        self.since_s += self.controller.step_length();
        self.close(self.controller.step_length());
        Answer::Invalid { error, hold: true }
    }

    /// The answer to the end of the input: the valves are closed.
    pub fn end(&mut self) -> Answer {
        self.close(VALID_S);
        let mut command = Command::blank(self.actuators, Status::NoSolution);
        command.position = self
            .controller
            .reference()
            .map_or(command.position, |r| r.0);
        Self::told(&command, vec![ENDED], [0.0; MAX_ACTUATORS])
    }

    /// Closes the valves as fast as they go, and returns their openings. The valves follow again after some good states.
    fn close(&mut self, seconds: f64) -> [f64; MAX_ACTUATORS] {
        self.needed = GOOD_ROWS;
        self.keep_closed(seconds)
    }

    fn keep_closed(&mut self, seconds: f64) -> [f64; MAX_ACTUATORS] {
        self.command = None;
        self.controller.hold();
        let unknown = [f64::NAN; MAX_ACTUATORS];
        self.controller.follow(&unknown[..self.actuators], seconds)
    }

    /// Returns the time since the state before (s), and its fault, if any.
    fn passed(&mut self) -> (f64, Option<&'static str>) {
        let step = self.controller.step_length();
        let before = std::mem::replace(&mut self.before_s, self.time_s);
        match (before, self.time_s) {
            (None, _) => (step, None),
            // once told, always told
            (Some(_), None) => {
                self.before_s = before;
                (step, Some(INPUT))
            }
            (Some(before), Some(now)) => match now - before {
                passed if passed > VALID_S => (VALID_S, Some(LATE)),
                passed if passed > 0.0 => (passed, None),
                _ => (0.0, Some(REPEATED)),
            },
        }
    }

    /// Reads a line into the state and returns the rod strokes.
    fn read(&mut self, line: &str) -> Result<Vec<f64>, ProtocolError> {
        let request: Request = serde_json::from_str(line)?;
        let known = |number: Number| number.unwrap_or(f64::NAN);
        for (motion, joint) in self.state.joints.iter_mut().zip(self.machine.joints()) {
            let found = request.joints.get(&joint.name);
            let [position, rate, acceleration] = found
                .ok_or_else(|| ProtocolError::Joint {
                    name: joint.name.clone(),
                })?
                .map(known);
            *motion = Motion {
                position,
                rate,
                acceleration,
            };
        }
        if request.rods.len() != self.actuators {
            return Err(ProtocolError::Rods {
                expected: self.actuators,
                found: request.rods.len(),
            });
        }
        self.pistons = [f64::NAN; MAX_ACTUATORS];
        if ![0, self.actuators].contains(&request.pressures.len()) {
            return Err(ProtocolError::Pressures {
                expected: self.actuators,
                found: request.pressures.len(),
            });
        }
        for (force, pair) in self.pistons.iter_mut().zip(&request.pressures) {
            let [piston, rod] = pair.map(known);
            *force = piston_force(&self.hydraulics, &Pressures { piston, rod });
        }
        self.time_s = request.time_s;
        let vector = |of: [Number; 3]| Vector3::from(of.map(known));
        self.state.imu.specific_force = vector(request.specific_force);
        self.state.imu.angular_velocity = vector(request.angular_velocity);
        self.state.imu.angular_acceleration = vector(request.angular_acceleration);
        self.state.base.up = vector(request.up);
        Ok(request.rods.into_iter().map(known).collect())
    }

    /// Returns the reasons for which the valves must not follow this state.
    fn doubts(&mut self, rods: &[f64]) -> Vec<&'static str> {
        let mut doubts = Vec::new();
        if self.has_input_fault() || !self.is_consistent(rods) {
            doubts.push(INPUT);
        }
        if rods.iter().any(|x| !x.is_finite()) {
            doubts.push(ROW_INVALID);
        } else if !self.controller.is_plausible(rods) {
            doubts.push(OUTSIDE_STROKE);
        }
        doubts
    }

    /// Checks the joints and the IMU as samples.
    fn has_input_fault(&mut self) -> bool {
        let stamp_ns = (self.since_s * 1e9) as i64;
        let joints = &self.state.joints;
        let positions = joints.iter().map(|joint| joint.position);
        let rates = joints.iter().map(|joint| joint.rate);
        self.joints.clear();
        self.joints.extend(positions.chain(rates));
        let imu = &self.state.imu;
        let measured = imu.specific_force.iter().chain(&imu.angular_velocity);
        for (place, &value) in self.imu.iter_mut().zip(measured) {
            *place = value;
        }
        let mut is_bad = false;
        for (sensor, values) in [
            (Sensor::Joints(0), &self.joints[..]),
            (Sensor::Imu, &self.imu[..]),
        ] {
            let sample = Sample::new(sensor, stamp_ns, values);
            is_bad |= self.checks.step(&sample).is_err();
            let mut findings = self.checks.findings().iter();
            is_bad |= findings.any(|finding| finding.forbids_rows(true));
        }
        let vectors = [imu.angular_acceleration, self.state.base.up];
        is_bad || vectors.iter().flatten().any(|x| !x.is_finite())
    }

    /// Whether the up direction is a unit vector, and the rods' strokes agree with the positions of their joints.
    fn is_consistent(&self, rods: &[f64]) -> bool {
        let linkages = self.machine.suspension().map(|s| s.linkages.as_slice());
        let mut pairs = linkages.unwrap_or_default().iter().zip(rods);
        let agree = pairs.all(|(&linkage, &stroke)| {
            let linkage = &self.machine.linkages()[linkage];
            let rod = linkage
                .solve(&self.state.joints[linkage.measured_joint])
                .rod;
            (rod.displacement - stroke).abs() <= ROD_TOLERANCE_M
        });
        (self.state.base.up.norm() - 1.0).abs() <= UNIT_TOLERANCE && agree
    }

    fn command(&mut self, rods: &[f64]) -> Answer {
        let (seconds, doubt) = self.passed();
        self.since_s += seconds;
        let mut doubts: Vec<_> = doubt.into_iter().collect();
        // a state that was told already says nothing new
        if doubt != Some(REPEATED) {
            doubts.extend(self.doubts(rods));
        }
        if !doubts.is_empty() {
            let opening = self.close(seconds);
            return self.held(doubts, rods, opening);
        }
        if self.needed > 0 {
            self.needed -= 1;
            let opening = self.keep_closed(seconds);
            return self.held(vec![STARTING], rods, opening);
        }
        let command = self.next(rods);
        self.due_s -= seconds;
        let motions = self.replay.rods(&self.state);
        let forces = self.replay.carried(&self.state, &motions, &self.pistons);
        let opening = self.controller.follow_loaded(rods, &forces, seconds);
        let mut reasons = Vec::new();
        if command.hold || command.status == Status::NoSolution {
            reasons.push(match self.controller.rod_fault() {
                Some((_, RodFault::Still)) => "not_following",
                Some((_, RodFault::WrongWay)) => "wrong_way",
                None => "no_solution",
            });
        }
        Self::told(&command, reasons, opening)
    }

    /// The controller's command, a new one if it is due.
    fn next(&mut self, rods: &[f64]) -> Command {
        let step = self.controller.step_length();
        let command = match self.command {
            Some(command) if self.due_s > 0.5 * step => command,
            _ => {
                self.due_s = (self.due_s + step).clamp(0.0, step);
                self.controller.tick(&self.state, rods)
            }
        };
        self.command = Some(command);
        command
    }

    /// Returns the answer that keeps the valves closed for these reasons, with the rods at these strokes.
    fn held(
        &self,
        reasons: Vec<&'static str>,
        rods: &[f64],
        opening: [f64; MAX_ACTUATORS],
    ) -> Answer {
        let status = match reasons.last() {
            Some(&ROW_INVALID) => Status::PositionUnknown,
            Some(&OUTSIDE_STROKE) => Status::PositionImplausible,
            _ => Status::NoSolution,
        };
        let mut command = Command::blank(self.actuators, status);
        for (place, &stroke) in command.position.iter_mut().zip(rods) {
            *place = stroke;
        }
        Self::told(&command, reasons, opening)
    }

    fn told(
        command: &Command,
        reasons: Vec<&'static str>,
        opening: [f64; MAX_ACTUATORS],
    ) -> Answer {
        let n = command.actuators;
        Answer::Command {
            status: command.status.name(),
            hold: !reasons.is_empty(),
            reasons,
            position: command.position[..n].to_vec(),
            velocity: command.velocity[..n].to_vec(),
            acceleration: command.acceleration[..n].to_vec(),
            opening: opening[..n].to_vec(),
            cost: command.cost,
        }
    }
}
