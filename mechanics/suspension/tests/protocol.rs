//! Lines of JSON: a loop over cylinders with and without measured pressures, and lines that are refused.

use crate::obedience::standing;
use crate::problems::{control, machine};
use serde_json::{Value, json};
use tipwatch_mechanics::machine::ControlMode;
use tipwatch_mechanics::verdict::limits::GOOD_ROWS;
use tipwatch_mechanics::{Machine, State};
use tipwatch_suspension::Controller;
use tipwatch_suspension::hydraulics::{Actuator, ActuatorInput, Pressures, Valve};
use tipwatch_suspension::protocol::{LineControl, Opening};

/// Load of each cylinder where it starts, and mass that moves with it.
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
    // unknown pressures are no error; the valves wait for good states
    let unknown: [Option<f64>; 2] = [None, None];
    for _ in 0..GOOD_ROWS {
        let answer = ask(json!([unknown, unknown]));
        assert_eq!(answer["reasons"], json!(["starting"]), "{answer}");
        assert_eq!(answer["hold"], true);
    }
    assert_eq!(ask(json!([unknown, unknown]))["hold"], false);
    assert_eq!(ask(json!([pair, pair]))["hold"], false);
}

/// Answers to states at these times (s), `None` for one without.
fn timed(times_s: &[Option<f64>]) -> Vec<Value> {
    let machine = machine();
    let state = standing(&machine);
    let settings = control(ControlMode::LookAhead, false);
    let (mut lines, _) = LineControl::new(&machine, &opening(&machine, &state), &settings).unwrap();
    let mut ask = |time_s: &Option<f64>| {
        let mut text = line(&machine, &state, &[-0.1; 2], &json!([]));
        if let Some(time_s) = time_s {
            text = text.replacen('{', &format!("{{\"time_s\": {time_s}, "), 1);
        }
        serde_json::to_value(lines.answer(&text)).unwrap()
    };
    times_s.iter().map(&mut ask).collect()
}

/// States that carry their time are followed at any period, and held when they come late, twice, or without it.
#[test]
fn late_repeated_and_untimed_states_are_held() {
    let at = |k: usize| Some(5.0 + 0.02 * k as f64);
    // one lost state is no fault, nor is a client that is faster than the control
    let good = timed(&[at(0), at(1), at(3), at(4), Some(5.085), Some(5.09)]);
    assert!(good.iter().all(|a| a["hold"] == false), "{good:?}");
    for (then, reason) in [
        (at(9), "late"),
        (at(3), "repeated"),
        (at(0), "repeated"),
        (Some(-1e300), "repeated"),
        (Some(1e300), "late"),
        (None, "input"),
    ] {
        let mut times = vec![at(0), at(1), at(2), at(3), then];
        let from = then.filter(|t| t.abs() < 1e9).or(at(3)).unwrap();
        let huge = then.is_some_and(|t| t.abs() > 1e9);
        times.extend((1..=GOOD_ROWS + 2).map(|k| Some(from + 0.02 * f64::from(k))));
        let answers = timed(&times);
        assert!(answers[..4].iter().all(|a| a["hold"] == false));
        assert_eq!(answers[4]["hold"], true, "{then:?}");
        assert_eq!(answers[4]["reasons"][0], reason, "{}", answers[4]);
        // and all is well again only after good states in a row
        let wait = GOOD_ROWS as usize + usize::from(huge);
        for answer in &answers[5..5 + wait] {
            assert_eq!(answer["hold"], true, "{then:?}: {answer}");
        }
        assert_eq!(answers[5 + wait]["hold"], false, "{then:?}");
        assert_eq!(answers[5 + wait]["reasons"], json!([]));
    }
}

/// The reference advances by the time between the states, not by their number.
#[test]
fn a_faster_client_gets_the_same_motion() {
    let machine = machine();
    let state = standing(&machine);
    let settings = control(ControlMode::LookAhead, false);
    let travelled = |period_s: f64| {
        let (mut lines, _) =
            LineControl::new(&machine, &opening(&machine, &state), &settings).unwrap();
        let mut farthest = 0.0_f64;
        for k in 0..(0.5 / period_s) as usize {
            let text = line(&machine, &state, &[-0.1; 2], &json!([]));
            let time_s = period_s * k as f64;
            let text = text.replacen('{', &format!("{{\"time_s\": {time_s}, "), 1);
            let answer = serde_json::to_value(lines.answer(&text)).unwrap();
            assert_eq!(answer["hold"], false, "{answer}");
            let position = answer["position"][0].as_f64().unwrap();
            farthest = farthest.max((position + 0.1).abs());
        }
        farthest
    };
    let [slow, fast] = [travelled(0.02), travelled(0.005)];
    println!("{slow:.5} m, {fast:.5} m");
    assert!(
        slow > 1e-4 && (fast / slow - 1.0).abs() < 0.2,
        "{slow} {fast}"
    );
}

/// The loads of locked rods are computed anew after a hold: the rods stay where they are.
#[test]
fn after_a_hold_locked_is_where_the_rods_are() {
    let machine = machine();
    let state = standing(&machine);
    let settings = control(ControlMode::LookAhead, false);
    let mut controller =
        Controller::new(&machine, &settings, &vec![0.0; machine.joints().len()]).unwrap();
    let mut fresh =
        Controller::new(&machine, &settings, &vec![0.0; machine.joints().len()]).unwrap();
    controller.tick(&state, &[-0.18; 2]);
    controller.follow(&[-0.18; 2], 0.02);
    controller.hold();
    let [resumed, new] = [&mut controller, &mut fresh].map(|c| c.tick(&state, &[-0.1; 2]));
    assert_eq!(resumed.acceleration, new.acceleration);
}
