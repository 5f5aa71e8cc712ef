//! The hydraulic cylinders of a machine's suspension over lines of JSON, to put them into a simulation.
//!
//! ```text
//!     cylinders MACHINE.toml
//!     out  {"friction": 20000, "rods": 2}
//!     in   {"load": [21e3, 20e3], "extension": [0.1, 0.1]}                                          once: at rest under this load
//!     in   {"opening": [0.1, 0.1], "extension": [0.1, 0.1], "velocity": [0.0, 0.0], "seconds": 1e-3}    each step
//!     out  {"force": [21e3, 20e3], "pressures": [[8e6, 7e6], [8e6, 7e6]]}                               to both
//! ```
//! By rod: valve command -1 to 1, extension from the smallest stroke (m), velocity of extension (m/s), force of the piston
//! on the rod (N), pressures on the piston's and on the rod's side (Pa). The friction (N s/m) is left to the simulation.

#![allow(clippy::print_stdout, reason = "the forces are its output")]

use std::error::Error;
use std::io::{BufRead, Write};
use std::path::Path;

use serde::Deserialize;
use serde_json::json;
use tipwatch_mechanics::machine::{LogFacts, MachineSpec};
use tipwatch_suspension::hydraulics::{Actuator, ActuatorInput, ActuatorState, Valve};

#[derive(Deserialize)]
#[serde(deny_unknown_fields, untagged)]
enum Line {
    Rest {
        load: Vec<f64>,
        extension: Vec<f64>,
    },
    Step {
        opening: Vec<f64>,
        extension: Vec<f64>,
        velocity: Vec<f64>,
        seconds: f64,
    },
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("expected a machine file")?;
    let path = Path::new(&path);
    let spec = MachineSpec::from_toml(&std::fs::read_to_string(path)?, &path.to_string_lossy())?;
    let urdf = path.with_file_name(spec.urdf.as_deref().ok_or("expected urdf")?);
    let machine = spec.check(
        &std::fs::read_to_string(&urdf)?,
        &urdf.to_string_lossy(),
        LogFacts::default(),
    )?;
    let suspension = machine.suspension().ok_or("expected [suspension]")?;
    let actuator = Actuator {
        parameters: suspension.hydraulics,
    };
    // the command is the opening itself
    let mut direct = actuator.parameters;
    direct.gain = 1.0;
    let mut out = std::io::stdout().lock();
    let rods = suspension.linkages.len();
    writeln!(
        out,
        "{}",
        json!({"friction": actuator.parameters.friction, "rods": rods})
    )?;
    let mut cylinders: Vec<ActuatorState> = Vec::new();
    let mut valves = vec![Valve::closed(); rods];
    for line in std::io::stdin().lock().lines() {
        match serde_json::from_str(&line?)? {
            Line::Rest { load, extension } => {
                let pairs = load.iter().zip(&extension);
                cylinders = pairs.map(|(&f, &x)| actuator.at_rest(x, f)).collect();
            }
            Line::Step {
                opening,
                extension,
                velocity,
                seconds,
            } => {
                for (k, cylinder) in cylinders.iter_mut().enumerate() {
                    let at = |values: &[f64]| values.get(k).copied().unwrap_or(f64::NAN);
                    valves[k] = valves[k].follow(&direct, at(&opening), 0.0, seconds);
                    cylinder.extension = at(&extension);
                    let input = ActuatorInput::Motion {
                        velocity: at(&velocity),
                    };
                    *cylinder = actuator.step(cylinder, valves[k], input, seconds)?;
                }
            }
        }
        let force: Vec<f64> = cylinders.iter().map(|c| actuator.force(c)).collect();
        let pressures: Vec<[f64; 2]> = cylinders
            .iter()
            .map(|c| [c.pressures.piston, c.pressures.rod])
            .collect();
        writeln!(out, "{}", json!({"force": force, "pressures": pressures}))?;
        out.flush()?;
    }
    Ok(())
}
