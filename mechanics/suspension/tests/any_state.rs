//! Robustness of the suspension control: for any input no panic, no command outside the limits, and no more
//! work than the documented bound.

#![allow(clippy::print_stdout, reason = "the outcomes are printed")]

use std::collections::BTreeMap;

use crate::problems::{Draws, Problem, control, machine, optimiser};
use tipwatch_mechanics::machine::ControlMode;
use tipwatch_mechanics::{Machine, State};
use tipwatch_suspension::{Command, Controller, Status, SuspensionOptimiser};

/// States per configuration; `TIPWATCH_STATES=250000` gives a million for the four configurations.
const STATES: usize = 4000;

/// Values that no sensor delivers.
const ODD: [f64; 10] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    1e300,
    -1e300,
    1e-310,
    0.0,
    -0.0,
    f64::MAX,
    1e9,
];

/// A problem with some values corrupted: slightly, beyond every limit, or not finite.
fn spoilt(
    draws: &mut Draws,
    machine: &Machine,
    optimiser: &SuspensionOptimiser,
    alike: bool,
) -> Problem {
    let mut problem = Problem::draw(draws, machine, optimiser, alike);
    let how = draws.signed();
    if how < -0.4 {
        return problem;
    }
    let odd = how > 0.5;
    let mut spoil = |value: &mut f64, scale: f64| {
        if draws.signed() > if odd { 0.7 } else { 0.4 } {
            *value = if odd {
                ODD[((draws.signed() + 1.0) * 0.5 * ODD.len() as f64) as usize % ODD.len()]
            } else {
                *value + scale * draws.signed().powi(3)
            };
        }
    };
    for (x, v) in problem.x.iter_mut().zip(&mut problem.v) {
        spoil(x, 0.5);
        spoil(v, 1.0);
    }
    spoil_state(&mut problem.state, &mut spoil);
    problem
}

fn spoil_state(state: &mut State<f64>, spoil: &mut impl FnMut(&mut f64, f64)) {
    for joint in &mut state.joints {
        spoil(&mut joint.position, 3.0);
        spoil(&mut joint.rate, 5.0);
        spoil(&mut joint.acceleration, 20.0);
    }
    let (imu, up) = (&mut state.imu, &mut state.base.up);
    for vector in [
        &mut imu.specific_force,
        &mut imu.angular_velocity,
        &mut imu.angular_acceleration,
        up,
    ] {
        vector.iter_mut().for_each(|value| spoil(value, 20.0));
    }
}

/// Invariants of every command.
fn check(command: &Command, problem: &Problem, optimiser: &SuspensionOptimiser, limits: &Limits) {
    let describe = || format!("{command:?} of {problem:?}");
    assert!(
        command.evaluations <= SuspensionOptimiser::MAX_EVALUATIONS,
        "{}",
        describe()
    );
    let dt = optimiser.step_length();
    for k in 0..2 {
        let [a, v, x] = [
            command.acceleration[k],
            command.velocity[k],
            command.position[k],
        ];
        assert!(a.abs() <= limits.acceleration * ROUNDED, "{}", describe());
        assert!(v.abs() <= limits.velocity * ROUNDED, "{}", describe());
        assert!(
            limits.stroke[0] <= x && x <= limits.stroke[1],
            "{}",
            describe()
        );
        if command.status > Status::StepTooShort {
            continue;
        }
        // (31b-f) hold up to rounding
        let (x0, v0) = (problem.x[k], problem.v[k]);
        let [least, greatest] = optimiser.acceleration_limits(x0);
        assert!(
            least - SLACK <= a && a <= greatest + SLACK,
            "{}",
            describe()
        );
        let [least, greatest] = optimiser.velocity_limits(x0);
        assert!(
            least - SLACK <= v && v <= greatest + SLACK,
            "{}",
            describe()
        );
        assert!((v - (v0 + dt * a)).abs() < SLACK, "{}", describe());
        assert!((x - (x0 + dt * v)).abs() < SLACK, "{}", describe());
    }
    if command.status == Status::PositionUnknown {
        assert!(command.hold);
    }
}

const SLACK: f64 = 1e-9;
const ROUNDED: f64 = 1.0 + 1e-12;

struct Limits {
    stroke: [f64; 2],
    velocity: f64,
    acceleration: f64,
}

#[test]
fn any_state_gives_a_command_within_limits() {
    let states = std::env::var("TIPWATCH_STATES").map_or(STATES, |n| n.parse().unwrap());
    let machine = machine();
    let suspension = machine.suspension().unwrap();
    let limits = Limits {
        stroke: suspension.stroke,
        velocity: suspension.max_velocity,
        acceleration: suspension.max_acceleration,
    };
    let mut endings: BTreeMap<Status, usize> = BTreeMap::new();
    for mode in [ControlMode::LookAhead, ControlMode::OneStep] {
        for independent in [false, true] {
            let mut optimiser = optimiser(&machine, &control(mode, independent));
            let mut draws = Draws(91 + u64::from(independent));
            for _ in 0..states {
                let problem = spoilt(&mut draws, &machine, &optimiser, !independent);
                if draws.signed() > 0.0 {
                    optimiser.reset();
                }
                let command = optimiser.step(&problem.state, &problem.x, &problem.v);
                check(&command, &problem, &optimiser, &limits);
                *endings.entry(command.status).or_insert(0) += 1;
            }
        }
    }
    println!("{endings:?}");
    for status in [
        Status::Optimal,
        Status::MarginLost,
        Status::OutsideLimits,
        Status::NoSolution,
        Status::PositionUnknown,
    ] {
        assert!(
            endings.contains_key(&status),
            "{status:?} never occurred: {endings:?}"
        );
    }
}

/// Optimiser and valves combined: the reference stays within the stroke, the valve commands saturate, and the
/// valves close where the input is unknown.
#[test]
fn controller_closes_valves_on_unknown_input() {
    let machine = machine();
    let control = control(ControlMode::LookAhead, false);
    let optimiser = optimiser(&machine, &control);
    let stroke = machine.suspension().unwrap().stroke;
    let posture = vec![0.0; machine.joints().len()];
    let mut controller = Controller::new(&machine, &control, &posture).unwrap();
    let mut draws = Draws(17);
    for _ in 0..STATES {
        let problem = spoilt(&mut draws, &machine, &optimiser, true);
        controller.tick(&problem.state, &problem.x);
        for _ in 0..3 {
            let openings = controller.follow(&problem.x, 0.007);
            assert!(openings.iter().all(|u| u.abs() <= 1.0), "{openings:?}");
        }
        if let Some((position, velocity)) = controller.reference() {
            for k in 0..2 {
                assert!(
                    (stroke[0]..=stroke[1]).contains(&position[k]),
                    "{position:?}"
                );
                assert!(velocity[k].abs() <= 0.1 + 1e-12, "{velocity:?}");
            }
        }
    }
    for _ in 0..100 {
        controller.tick(&State::zero(&machine), &[f64::NAN; 2]);
        controller.follow(&[f64::NAN; 2], 0.02);
    }
    assert_eq!(controller.follow(&[f64::NAN; 2], 0.02), [0.0; 2]);
}
