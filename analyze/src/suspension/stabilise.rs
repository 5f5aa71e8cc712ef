//! The suspension optimiser over lines of JSON: states in, commands out, for simulation or hardware in
//! the loop.
//!
//! ```text
//! in   {"joints": {"slew": 0.1, ...}}                                      once: the measured joints
//! and their positions
//!     out  {"rods": ["suspension_right", ...], "step_s": 0.02, "stroke_m": [-0.2, 0.0]}
//!     in   {"joints": {"slew": [0.1, 0.0, 0.0], ...}, "rods": [-0.1, -0.1], "specific_force": [0, 0, 9.8],
//! "angular_velocity": [0, 0, 0], "angular_acceleration": [0, 0, 0], "up": [0, 0, 1]}         each step
//! out  {"status": "optimal", "hold": false, "position": [...], "velocity": [...], "acceleration":
//! [...], "opening": [...], "cost": 1.2}
//! ```
//! Joints have position, velocity and acceleration (rad or m, s); rods have strokes (m). The remaining
//! keys are the IMU measurements in the sensor frame and the upward unit vector in base axes. `null` is
//! an unknown number. An invalid line is answered by `{"error": "..."}` and has no other effect.

use std::collections::BTreeMap;
use std::io::{BufRead, Write};

use anyhow::{Context, Result, anyhow, ensure};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::{ControlMode, LogFacts, Machine};
use tipwatch_mechanics::{Motion, State};
use tipwatch_suspension::Controller;

/// The first line.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Opening {
    joints: BTreeMap<String, f64>,
}

/// The answer to it.
#[derive(Debug, Serialize)]
struct Ready<'a> {
    rods: Vec<&'a str>,
    step_s: f64,
    stroke_m: [f64; 2],
}

/// A number, or `null` if unknown.
type Number = Option<f64>;

/// A state that requests a command.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    joints: BTreeMap<String, [Number; 3]>,
    rods: Vec<Number>,
    specific_force: [Number; 3],
    angular_velocity: [Number; 3],
    angular_acceleration: [Number; 3],
    up: [Number; 3],
}

/// A command; values that are not finite are null.
#[derive(Debug, Serialize)]
struct Answer {
    status: &'static str,
    hold: bool,
    position: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    opening: Vec<f64>,
    cost: f64,
}

/// Serves one client until it closes its input. `mode` and `step_s` override the machine file.
///
/// # Errors
/// The machine has no controllable suspension, the first line does not name its joints, or reading or
/// writing fails.
pub fn serve(
    file: &MachineFile,
    mode: Option<ControlMode>,
    step_s: Option<f64>,
    input: impl BufRead,
    mut output: impl Write,
) -> Result<()> {
    let mut lines = input.lines();
    let first = lines
        .next()
        .ok_or_else(|| anyhow!("expected a first line with the joints, found none"))?
        .context("standard input: cannot be read")?;
    let opening: Opening = serde_json::from_str(&first)
        .context("first line: expected {\"joints\": {name: position}}")?;
    let machine = machine(file, &opening)?;
    let posture = posture(&machine, &opening)?;
    let suspension = machine
        .suspension()
        .ok_or_else(|| anyhow!("{}: expected [suspension], found none", file.path.display()))?;
    let mut control = suspension.control.clone();
    control.mode = mode.unwrap_or(control.mode);
    control.rate = step_s.map_or(control.rate, |step| 1.0 / step);
    let mut controller = Controller::new(&machine, &control, &posture)?;
    let linkages = suspension.linkages.iter();
    let ready = Ready {
        rods: linkages
            .map(|&l| machine.linkages()[l].name.as_str())
            .collect(),
        step_s: controller.step_length(),
        stroke_m: suspension.stroke,
    };
    answer(&mut output, &ready)?;
    let mut state = State::zero(&machine);
    for line in lines {
        let line = line.context("standard input: cannot be read")?;
        if line.trim().is_empty() {
            continue;
        }
        match read(&machine, &line, &mut state) {
            Ok(rods) => answer(&mut output, &command(&mut controller, &state, &rods))?,
            Err(error) => {
                let refusal = BTreeMap::from([("error", format!("{error:#}"))]);
                answer(&mut output, &refusal)?;
            }
        }
    }
    Ok(())
}

fn machine(file: &MachineFile, opening: &Opening) -> Result<Machine> {
    let urdf = file.urdf(None, None)?;
    let names: Vec<String> = opening.joints.keys().cloned().collect();
    let facts = LogFacts {
        joint_names: Some(&names),
        ..LogFacts::default()
    };
    Ok(file.spec.check(&urdf.text, &urdf.name, facts)?)
}

/// Positions of the machine's joints.
fn posture(machine: &Machine, opening: &Opening) -> Result<Vec<f64>> {
    let joints = machine.joints().iter();
    joints
        .map(|joint| {
            let found = opening.joints.get(&joint.name).copied();
            found
                .ok_or_else(|| anyhow!("first line: expected joint \"{}\", found none", joint.name))
        })
        .collect()
}

/// Reads a line into the state and returns the rod strokes.
fn read(machine: &Machine, line: &str, state: &mut State<f64>) -> Result<Vec<f64>> {
    let asked: Asked = serde_json::from_str(line)?;
    let known = |number: Number| number.unwrap_or(f64::NAN);
    for (motion, joint) in state.joints.iter_mut().zip(machine.joints()) {
        let [position, rate, acceleration] = asked
            .joints
            .get(&joint.name)
            .ok_or_else(|| anyhow!("expected joint \"{}\", found none", joint.name))?
            .map(known);
        *motion = Motion {
            position,
            rate,
            acceleration,
        };
    }
    let actuators = machine.suspension().map_or(0, |s| s.linkages.len());
    ensure!(
        asked.rods.len() == actuators,
        "rods: expected {actuators} numbers, found {}",
        asked.rods.len()
    );
    let vector = |of: [Number; 3]| Vector3::from(of.map(known));
    state.imu.specific_force = vector(asked.specific_force);
    state.imu.angular_velocity = vector(asked.angular_velocity);
    state.imu.angular_acceleration = vector(asked.angular_acceleration);
    state.base.up = vector(asked.up);
    Ok(asked.rods.into_iter().map(known).collect())
}

fn command(controller: &mut Controller, state: &State<f64>, rods: &[f64]) -> Answer {
    let command = controller.tick(state, rods);
    let openings = controller.follow(rods, controller.step_length());
    let n = command.actuators;
    Answer {
        status: command.status.name(),
        hold: command.hold,
        position: command.position[..n].to_vec(),
        velocity: command.velocity[..n].to_vec(),
        acceleration: command.acceleration[..n].to_vec(),
        opening: openings[..n].to_vec(),
        cost: command.cost,
    }
}

fn answer(output: &mut impl Write, value: &impl Serialize) -> Result<()> {
    let mut text = serde_json::to_string(value)?;
    text.push('\n');
    output
        .write_all(text.as_bytes())
        .and_then(|()| output.flush())
        .context("standard output: cannot be written")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use std::path::Path;

    use super::*;

    const DATA: &str = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../tests/data/second_paper.toml"
    );
    const JOINTS: [(&str, f64); 10] = [
        ("slew", 0.0),
        ("lift", -1.5),
        ("tilt", -1.5),
        ("extension", 0.3),
        ("suspension_right", -0.1),
        ("suspension_left", -0.1),
        ("wheel_fl", 0.0),
        ("wheel_fr", 0.0),
        ("wheel_rl", 0.0),
        ("wheel_rr", 0.0),
    ];

    fn talk(lines: &[String]) -> Result<Vec<serde_json::Value>> {
        let file = MachineFile::read(Path::new(DATA)).unwrap();
        let mut output = Vec::new();
        serve(&file, None, None, lines.join("\n").as_bytes(), &mut output)?;
        let text = String::from_utf8(output).unwrap();
        Ok(text
            .lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect())
    }

    fn first() -> String {
        let joints: BTreeMap<_, _> = JOINTS.into_iter().collect();
        serde_json::json!({ "joints": joints }).to_string()
    }

    fn asked(rods: [Number; 2], up: f64) -> String {
        let joints: BTreeMap<_, _> = JOINTS.map(|(name, at)| (name, [at, 0.0, 0.0])).into();
        serde_json::json!({ "joints": joints, "rods": rods, "specific_force": [0.0, 0.0, up], "angular_velocity": [0, 0, 0],
            "angular_acceleration": [0, 0, 0], "up": [0, 0, 1] })
        .to_string()
    }

    #[test]
    fn states_get_commands_and_invalid_lines_get_errors() {
        let rods = [Some(-0.1), Some(-0.1)];
        let answers = talk(&[
            first(),
            asked(rods, 9.8066),
            "{\"joints\": 1}".into(),
            asked([None, Some(-0.1)], 9.8066),
            asked(rods, f64::NAN),
        ])
        .unwrap();
        assert_eq!(answers[0]["rods"][0], "suspension_right");
        assert_eq!(answers[1]["status"], "optimal");
        // the arm is in front: the platform moves backwards
        assert!(answers[1]["acceleration"][0].as_f64().unwrap().abs() > 0.01);
        assert!(answers[2]["error"].is_string());
        assert_eq!(answers[3]["status"], "position_unknown");
        assert_eq!(answers[3]["hold"], true);
        assert_eq!(answers[4]["status"], "no_solution");
        assert_eq!(answers.len(), 5);
    }

    #[test]
    fn a_machine_without_suspension_is_rejected() {
        let file = MachineFile::read(Path::new(DATA)).unwrap();
        let short = serve(
            &file,
            Some(ControlMode::OneStep),
            None,
            first().as_bytes(),
            Vec::new(),
        );
        assert!(format!("{:#}", short.unwrap_err()).contains("1.5 times"));
        let unnamed = talk(&["{\"joints\": {}}".into()]);
        assert!(unnamed.is_err());
    }
}
