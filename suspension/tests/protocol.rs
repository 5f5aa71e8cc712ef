//! Lines of JSON: a loop over cylinders with and without measured pressures, and lines that are refused.

use crate::obedience::standing;
use crate::problems::{control, machine};
use serde_json::{Value, json};
use tipwatch_mechanics::machine::ControlMode;
use tipwatch_mechanics::{Machine, State};
use tipwatch_suspension::hydraulics::{Actuator, ActuatorInput, Pressures, Valve};
use tipwatch_suspension::protocol::{LineControl, Opening};

/// Load of each cylinder where it starts, and what moves with it.
const MASS: f64 = 1e4;

fn opening(machine: &Machine, state: &State<f64>) -> Opening {
    let names = machine.joints().iter().map(|joint| joint.name.clone());
    let positions = state.joints.iter().map(|joint| joint.position);
    let joints: serde_json::Map<String, Value> = names
        .zip(positions.map(|position| json!(position)))
        .collect();
    Opening::parse(&json!({ "joints": joints }).to_string()).unwrap()
}

fn line(machine: &Machine, state: &State<f64>, rods: &[f64; 2], pressures: &Value) -> String {
    let joints: serde_json::Map<String, Value> = machine
        .joints()
        .iter()
        .zip(&state.joints)
        .map(|(joint, motion)| {
            let rod = ["suspension_right", "suspension_left"]
                .iter()
                .position(|name| *name == joint.name);
            let position = rod.map_or(motion.position, |rod| rods[rod]);
            (joint.name.clone(), json!([position, 0.0, 0.0]))
        })
        .collect();
    json!({
        "joints": joints, "rods": rods, "specific_force": [0.0, 0.0, machine.gravity()],
        "angular_velocity": [0.0, 0.0, 0.0], "angular_acceleration": [0.0, 0.0, 0.0], "up": [0.0, 0.0, 1.0],
        "pressures": pressures,
    })
    .to_string()
}

/// The largest acceleration of the rods some time after a jump of their load.
fn ringing(knows_pressures: bool) -> f64 {
    let machine = machine();
    let state = standing(&machine);
    let settings = control(ControlMode::LookAhead, false);
    let (mut lines, _) = LineControl::new(&machine, &opening(&machine, &state), &settings).unwrap();
    let suspension = machine.suspension().unwrap();
    let actuator = Actuator {
        parameters: suspension.hydraulics,
    };
    let mut direct = actuator.parameters;
    direct.gain = 1.0;
    let load = 1e4;
    let mut rods = [actuator.at_rest(0.1, load); 2];
    let mut valves = [Valve::closed(); 2];
    let mut largest = 0.0_f64;
    for step in 0..100 {
        let strokes = rods.map(|rod| suspension.stroke[0] + rod.extension);
        let pressures = match knows_pressures {
            true => json!(rods.map(|rod| [rod.pressures.piston, rod.pressures.rod])),
            false => json!([]),
        };
        let text = line(&machine, &state, &strokes, &pressures);
        let answer = serde_json::to_value(lines.answer(&text)).unwrap();
        assert_eq!(answer["hold"], false, "{step}: {answer}");
        for (k, rod) in rods.iter_mut().enumerate() {
            let wanted = answer["opening"][k].as_f64().unwrap();
            valves[k] = valves[k].follow(&direct, wanted, 0.0, 0.02);
            let before = rod.velocity;
            let force = if step < 60 { load } else { 1.5 * load };
            let input = ActuatorInput::Load { force, mass: MASS };
            *rod = actuator.step(rod, valves[k], input, 0.02).unwrap();
            if step >= 75 {
                largest = largest.max((rod.velocity - before).abs() / 0.02);
            }
        }
    }
    largest
}

#[test]
fn measured_pressures_damp_the_oscillation() {
    let [blind, seeing] = [ringing(false), ringing(true)];
    println!("{blind:.3} m/s2 without pressures, {seeing:.3} m/s2 with them");
    assert!(seeing < 0.5 * blind, "{seeing} {blind}");
}

#[test]
fn wrong_number_of_pressures_is_refused() {
    let machine = machine();
    let state = standing(&machine);
    let settings = control(ControlMode::LookAhead, false);
    let (mut lines, _) = LineControl::new(&machine, &opening(&machine, &state), &settings).unwrap();
    let pressures = Pressures {
        piston: 8e6,
        rod: 6e6,
    };
    let pair = [pressures.piston, pressures.rod];
    let mut ask = |pressures: Value| {
        let text = line(&machine, &state, &[-0.1; 2], &pressures);
        serde_json::to_value(lines.answer(&text)).unwrap()
    };
    let refused = ask(json!([pair]));
    assert_eq!(refused["hold"], true);
    assert!(refused["error"].as_str().unwrap().contains("pressures"));
    // unknown pressures are no error
    let unknown: [Option<f64>; 2] = [None, None];
    assert_eq!(ask(json!([unknown, unknown]))["hold"], false);
    assert_eq!(ask(json!([pair, pair]))["hold"], false);
}
