//! The controller believes no rod that does not obey its valve or is outside its stroke, and damps the oil.

use crate::problems::{control, machine};
use crate::support;
use nalgebra::Vector3;
use tipwatch_mechanics::machine::{ControlMode, HydraulicsSpec};
use tipwatch_mechanics::{Machine, Motion, State};
use tipwatch_suspension::hydraulics::{Actuator, ActuatorInput, Valve, ValveInput};
use tipwatch_suspension::{Controller, RodFault, Status, TRIAL_OPENING};

const DT: f64 = 0.01;
/// Velocity of a rod with its valve fully open (m/s).
const FULL: f64 = 0.2;

/// The arm stretched forward on level ground.
pub(crate) fn standing(machine: &Machine) -> State<f64> {
    let mut state = State::zero(machine);
    for (motion, joint) in state.joints.iter_mut().zip(machine.joints()) {
        let position = match joint.name.as_str() {
            "lift" => -1.3,
            "tilt" => -1.3,
            "extension" => 0.3,
            "suspension_right" | "suspension_left" => -0.1,
            _ => 0.0,
        };
        *motion = Motion::at_rest(position);
    }
    state.base.up = Vector3::z();
    state.imu.specific_force = Vector3::z() * machine.gravity();
    state
}

fn controller(machine: &Machine) -> (Controller, State<f64>) {
    let state = standing(machine);
    let posture: Vec<f64> = state.joints.iter().map(|joint| joint.position).collect();
    let control = control(ControlMode::LookAhead, false);
    let controller = Controller::new(machine, &control, &posture).unwrap();
    (controller, state)
}

/// Rods whose velocity is `FULL` times this factor times the opening, for 3 s; returns their motion (m).
fn driven(factor: f64) -> (Controller, f64, f64) {
    let machine = machine();
    let (mut controller, state) = controller(&machine);
    let (mut rods, mut largest) = ([-0.1; 2], 0.0_f64);
    for tick in 0..300 {
        if tick % 2 == 0 {
            controller.tick(&state, &rods);
        }
        let openings = controller.follow(&rods, DT);
        if rods.iter().all(|rod| (rod + 0.1).abs() < 1e-3) {
            largest = openings.iter().fold(largest, |most, u| most.max(u.abs()));
        }
        for (rod, opening) in rods.iter_mut().zip(openings) {
            *rod += DT * FULL * factor * opening;
        }
    }
    (controller, rods[0] + 0.1, largest)
}

#[test]
fn reversed_valves_are_found_at_a_small_opening() {
    let (obeying, travelled, first) = driven(1.0);
    assert_eq!(obeying.rod_fault(), None);
    assert!(travelled.abs() > 0.02, "{travelled}");
    assert!(first <= TRIAL_OPENING + 1e-12, "{first}");
    let (mut reversed, travelled, first) = driven(-1.0);
    assert!(
        matches!(reversed.rod_fault(), Some((_, RodFault::WrongWay))),
        "{travelled}"
    );
    assert!(travelled.abs() < 0.006, "{travelled}");
    assert!(first <= TRIAL_OPENING + 1e-12, "{first}");
    // it holds until somebody says otherwise
    let state = standing(&machine());
    let command = reversed.tick(&state, &[-0.1; 2]);
    assert_eq!(command.status, Status::NotFollowing);
    assert!(command.hold && command.status.is_alarm());
    assert_eq!(reversed.follow(&[-0.1; 2], 1.0), [0.0; 2]);
    reversed.trust_rods();
    assert!(!reversed.tick(&state, &[-0.1; 2]).hold);
}

// requirement: TW-CONTROL-06
#[test]
fn a_second_step_without_solution_holds() {
    let machine = machine();
    let (mut controller, state) = controller(&machine);
    assert!(!controller.tick(&state, &[-0.1; 2]).hold);
    let mut unknown = state.clone();
    unknown.imu.specific_force.x = f64::NAN;
    let first = controller.tick(&unknown, &[-0.1; 2]);
    assert_eq!((first.status, first.hold), (Status::NoSolution, false));
    let second = controller.tick(&unknown, &[-0.1; 2]);
    assert_eq!((second.status, second.hold), (Status::NoSolution, true));
    assert_eq!(controller.follow(&[-0.1; 2], 1.0), [0.0; 2]);
    // and it goes on as soon as there is one
    assert!(!controller.tick(&state, &[-0.1; 2]).hold);
}

#[test]
fn rod_that_stands_still_is_found() {
    let (controller, _, _) = driven(0.0);
    assert!(matches!(controller.rod_fault(), Some((_, RodFault::Still))));
}

#[test]
fn rod_outside_its_stroke_is_not_followed() {
    let machine = machine();
    let (mut controller, state) = controller(&machine);
    for outside in [0.4, 0.02, -0.22, -1.0] {
        for _ in 0..20 {
            controller.tick(&state, &[-0.1; 2]);
            controller.follow(&[-0.1; 2], DT);
        }
        let command = controller.tick(&state, &[-0.1, outside]);
        assert_eq!(command.status, Status::PositionImplausible, "{outside}");
        assert!(command.hold && command.status.is_alarm());
        assert_eq!(controller.follow(&[-0.1, outside], 1.0), [0.0; 2]);
    }
    // a sensor's noise at the end of the stroke is no fault
    let command = controller.tick(&state, &[0.005, 0.005]);
    assert_ne!(command.status, Status::PositionImplausible);
}

/// A jump of the load makes the rod oscillate on its oil. With measured pressures the valve damps that.
#[test]
fn val_pressure_feedback_damps_the_oscillation() {
    let parameters = HydraulicsSpec::default().parameters(0.2);
    let actuator = Actuator { parameters };
    let left = |knows_pressures: bool| -> f64 {
        let mut rod = actuator.at_rest(0.1, 2e4);
        let (mut valve, mut largest) = (Valve::closed(), 0.0_f64);
        for tick in 0..100 {
            let input = ValveInput {
                wanted: 0.1,
                velocity: 0.0,
                found: rod.extension,
                extension: rod.extension,
                force: match knows_pressures {
                    true => actuator.force(&rod),
                    false => f64::NAN,
                },
                load: 3e4,
                max_opening: 1.0,
            };
            valve = valve.steer(&parameters, &input, DT);
            let load = ActuatorInput::Load {
                force: 3e4,
                mass: 20e3,
            };
            let before = rod.velocity;
            rod = actuator.step(&rod, valve, load, DT).unwrap();
            if tick >= 40 {
                largest = largest.max((rod.velocity - before).abs() / DT);
            }
        }
        largest
    };
    let [undamped, damped] = [left(false), left(true)];
    assert!(damped < 0.2 * undamped, "{damped} {undamped}");
    assert!(undamped > 0.1, "{undamped}");
}

#[test]
fn steady_reference_is_followed_without_lag() {
    let machine = support::bogie(|text| text).unwrap();
    let hydraulics = machine.suspension().unwrap().hydraulics;
    let actuator = Actuator {
        parameters: hydraulics,
    };
    let mut rod = actuator.at_rest(0.05, 2e4);
    let mut valve = Valve::closed();
    for tick in 0..150 {
        let wanted = 0.05 + 0.05 * DT * f64::from(tick);
        let input = ValveInput {
            wanted,
            velocity: 0.05,
            found: rod.extension,
            extension: rod.extension,
            force: actuator.force(&rod),
            load: 2e4,
            max_opening: 1.0,
        };
        valve = valve.steer(&hydraulics, &input, DT);
        let load = ActuatorInput::Load {
            force: 2e4,
            mass: 20e3,
        };
        rod = actuator.step(&rod, valve, load, DT).unwrap();
        // the law of the paper lags by 0.05/(k_p V) = 25 mm
        assert!((wanted - rod.extension).abs() < 4e-3, "{tick} {rod:?}");
    }
}
