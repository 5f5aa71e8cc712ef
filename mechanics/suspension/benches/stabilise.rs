//! Time of one step of the suspension optimiser on random problems of the machine on bogies, without warm
//! start: median to maximum, including the condensation of the machine; and of one tick of the whole control, load
//! guard included.
//!
//! `cargo bench -p tipwatch-suspension --bench stabilise [-- NAME]`, where NAME is part of a line's label.

#![allow(clippy::print_stdout, reason = "a benchmark prints")]

mod problems;

use std::collections::BTreeMap;
use std::hint::black_box;
use std::time::Instant;

use problems::{Draws, Problem, control, machine, optimiser};
use tipwatch_mechanics::machine::ControlMode;
use tipwatch_suspension::{Controller, Status};

const PROBLEMS: usize = 20_000;
/// Each problem takes the shortest of several runs, to exclude interference from other processes.
const REPEATS: usize = 5;

fn main() {
    let machine = machine();
    let wanted = std::env::args().skip(1).find(|word| !word.starts_with('-'));
    println!("microseconds a step, {PROBLEMS} problems solved from scratch");
    println!(
        "{:22} {:>8} {:>8} {:>8} {:>8} {:>11} {:>11}",
        "", "median", "p99", "p99.9", "max", "evaluations", "of them max"
    );
    for mode in [ControlMode::LookAhead, ControlMode::OneStep] {
        for independent in [false, true] {
            let name = format!(
                "{} {}",
                if mode == ControlMode::OneStep {
                    "literal"
                } else {
                    "look-ahead"
                },
                if independent {
                    "2 variables"
                } else {
                    "1 variable"
                }
            );
            if wanted.as_ref().is_some_and(|wanted| !name.contains(wanted)) {
                continue;
            }
            let mut optimiser = optimiser(&machine, &control(mode, independent));
            let mut draws = Draws(7);
            let problems: Vec<Problem> = (0..PROBLEMS)
                .map(|_| Problem::draw(&mut draws, &machine, &optimiser, !independent))
                .collect();
            let mut times = vec![f64::INFINITY; PROBLEMS];
            let mut first = Vec::new();
            let (mut sum, mut most, mut endings) = (0, 0, BTreeMap::new());
            for run in 0..REPEATS {
                for (problem, time) in problems.iter().zip(&mut times) {
                    optimiser.reset();
                    let start = Instant::now();
                    let command = optimiser.step(black_box(&problem.state), &problem.x, &problem.v);
                    let took = start.elapsed().as_secs_f64() * 1e6;
                    *time = time.min(took);
                    black_box(&command);
                    if run == 0 {
                        first.push(took);
                        sum += command.evaluations;
                        most = most.max(command.evaluations);
                        *endings.entry(command.status).or_insert(0) += 1;
                    }
                }
            }
            let line = |name: &str, times: &mut Vec<f64>| {
                times.sort_by(f64::total_cmp);
                let at = |share: f64| times[((PROBLEMS - 1) as f64 * share) as usize];
                println!(
                    "{name:22} {:8.2} {:8.2} {:8.2} {:8.2} {:11.2} {most:11}",
                    at(0.5),
                    at(0.99),
                    at(0.999),
                    at(1.0),
                    sum as f64 / PROBLEMS as f64
                );
            };
            line(&name, &mut times);
            line("  first run of each", &mut first);
            let posture: Vec<f64> = problems[0]
                .state
                .joints
                .iter()
                .map(|joint| joint.position)
                .collect();
            let mut settings = control(mode, independent);
            // long enough for any posture
            if mode == ControlMode::OneStep {
                settings.rate = 0.2;
            }
            let mut controller = Controller::new(&machine, &settings, &posture)
                .expect("a machine with a suspension");
            let mut ticks = vec![f64::INFINITY; PROBLEMS];
            for _ in 0..REPEATS {
                for (problem, time) in problems.iter().zip(&mut ticks) {
                    controller.reset();
                    let start = Instant::now();
                    let command = controller.tick(black_box(&problem.state), &problem.x);
                    *time = time.min(start.elapsed().as_secs_f64() * 1e6);
                    black_box(&command);
                }
            }
            line("  tick with guard", &mut ticks);
            let counts = endings
                .iter()
                .map(|(status, n): (&Status, &usize)| format!("{} {n}", status.name()));
            println!("  {}", counts.collect::<Vec<_>>().join(", "));
        }
    }
}
