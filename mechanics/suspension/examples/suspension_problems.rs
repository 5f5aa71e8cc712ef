//! Random problems of the suspension control and their solutions, one JSON object per line, for comparison with
//! another solver.
//!
//! `cargo run --release --example suspension_problems -- look-ahead|literal 1|2 COUNT`

#![allow(clippy::print_stdout, reason = "the problems are its output")]

#[path = "../benches/problems/mod.rs"]
mod problems;

use std::time::Instant;

use problems::{Draws, Problem, control, machine, optimiser};
use serde_json::json;
use tipwatch_mechanics::machine::ControlMode;

/// Each problem takes the shortest of several runs, without warm start.
const REPEATS: usize = 7;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let (mode, independent, count) = match &words[..] {
        [mode, variables, count] => (mode.as_str(), variables == "2", count.parse().unwrap_or(0)),
        _ => ("look-ahead", false, 10),
    };
    let mode = match mode {
        "literal" => ControlMode::OneStep,
        _ => ControlMode::LookAhead,
    };
    let machine = machine();
    let control = control(mode, independent);
    let mut optimiser = optimiser(&machine, &control);
    println!(
        "{}",
        json!({
            "step": optimiser.step_length(),
            "look_ahead": control.look_ahead,
            "zone": optimiser.approach_zone(),
            "acceleration_at_stop": control.acceleration_at_stop,
            "min_stability_angle": control.min_stability_angle,
        })
    );
    let mut draws = Draws(2024);
    for _ in 0..count {
        let problem = Problem::draw(&mut draws, &machine, &optimiser, !independent);
        let mut took = f64::INFINITY;
        let mut command = None;
        for _ in 0..REPEATS {
            optimiser.reset();
            let start = Instant::now();
            let found = optimiser.step(&problem.state, &problem.x, &problem.v);
            took = took.min(start.elapsed().as_secs_f64());
            command = Some(found);
        }
        let Some(command) = command else { continue };
        let state = &problem.state;
        let joints: serde_json::Map<_, _> = machine
            .joints()
            .iter()
            .zip(&state.joints)
            .map(|(joint, m)| {
                (
                    joint.name.clone(),
                    json!([m.position, m.rate, m.acceleration]),
                )
            })
            .collect();
        println!(
            "{}",
            json!({
                "joints": joints,
                "specific_force": state.imu.specific_force.as_slice(),
                "angular_velocity": state.imu.angular_velocity.as_slice(),
                "angular_acceleration": state.imu.angular_acceleration.as_slice(),
                "up": state.base.up.as_slice(),
                "x": problem.x,
                "v": problem.v,
                "status": command.status.name(),
                "acceleration": command.acceleration,
                "target": command.target,
                "cost": command.cost,
                "iterations": command.iterations,
                "evaluations": command.evaluations,
                "seconds": took,
            })
        );
    }
}
