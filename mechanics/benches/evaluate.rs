//! Time of one evaluation of the simulated machine: fifteen bodies, two closed chains, loads and envelope.
//!
//! `cargo bench -p tipwatch-mechanics`. If `TIPWATCH_PINOCCHIO` is set to a program that times Pinocchio's `rnea`
//! on the same bodies (`benches/pinocchio/`), it is run before and after on the same computer.

#![allow(clippy::print_stdout, reason = "a benchmark prints its result")]

use std::hint::black_box;
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

use tipwatch_mechanics::machine::{LogFacts, MachineSpec};
use tipwatch_mechanics::{
    Lanes, Machine, Model, Scope, State, StateColumns, Workspace, evaluate, evaluate_rows,
};

const STATES: usize = 1024;
const REPEATS: usize = 400;

fn main() {
    let machine = machine();
    let states = states(&machine);
    peer();
    let one_by_one = separate(&machine, &states);
    let scalar = nanoseconds_a_state(|| scalar(&machine, &one_by_one));
    let side_by_side = side_by_side(&machine, &one_by_one);
    let lanes = nanoseconds_a_state(|| lanes(&machine, &side_by_side));
    let by_rows = |scope| {
        let model = Arc::new(Model::WholeBody);
        nanoseconds_a_state(|| {
            black_box(evaluate_rows(
                &machine,
                black_box(&states),
                0..STATES,
                scope,
                &model,
            ));
        })
    };
    let rows = by_rows(Scope::LOADS);
    let everything = by_rows(Scope::ALL);
    let loads_again = by_rows(Scope::LOADS);
    println!(
        "evaluate, f64:            {scalar:7.0} ns a sample (minimum of {REPEATS} runs over {STATES} states)"
    );
    println!(
        "evaluate, lanes:          {lanes:7.0} ns a sample, {:.1} times as fast",
        scalar / lanes
    );
    println!("evaluate_rows, lanes:     {rows:7.0} ns a sample, from columns to columns");
    println!(
        "full scope, lanes:        {everything:7.0} ns a sample, {:.1} times the loads alone",
        everything / rows.min(loads_again)
    );
    for (what, scope) in [
        (
            "indicators",
            Scope {
                indicators: true,
                ..Scope::LOADS
            },
        ),
        (
            "causes",
            Scope {
                contributions: true,
                ..Scope::LOADS
            },
        ),
        (
            "sensitivities",
            Scope {
                sensitivities: true,
                ..Scope::LOADS
            },
        ),
    ] {
        println!("  {what:23} {:7.0} ns a sample more", by_rows(scope) - rows);
    }
    peer();
}

fn machine() -> Machine {
    let spec = MachineSpec::from_toml(include_str!("../tests/data/rigid.toml"), "rigid.toml")
        .expect("a valid machine file");
    spec.check(
        include_str!("../tests/data/rigid.urdf"),
        "rigid.urdf",
        LogFacts::default(),
    )
    .expect("a valid machine")
}

/// Working postures in motion, all wheels on the ground in most of them.
fn states(machine: &Machine) -> StateColumns {
    let mut columns = StateColumns::unknown(machine, STATES);
    let mut state = State::<f64>::zero(machine);
    for row in 0..STATES {
        let phase = row as f64 * 0.61;
        for (k, (joint, motion)) in machine.joints().iter().zip(&mut state.joints).enumerate() {
            let middle = if ["lift", "tilt"].contains(&joint.name.as_str()) {
                -1.3
            } else {
                0.2
            };
            motion.position = middle + 0.3 * (phase + k as f64).sin();
            motion.rate = 0.2 * (1.3 * phase + k as f64).cos();
            motion.acceleration = 0.3 * (0.7 * phase + k as f64).sin();
        }
        state.imu.specific_force =
            nalgebra::Vector3::new(0.5 * phase.sin(), 0.4 * (1.7 * phase).cos(), 9.8);
        state.imu.angular_velocity = nalgebra::Vector3::new(0.05, -0.03, 0.3) * phase.cos();
        state.imu.angular_acceleration = nalgebra::Vector3::new(0.1, 0.2, -0.1) * phase.sin();
        columns.set(row, &mut state);
    }
    columns
}

fn separate(machine: &Machine, states: &StateColumns) -> Vec<State<f64>> {
    let mut state = State::<f64>::zero(machine);
    let mut at = |row| {
        states.get(row, &mut state);
        state.clone()
    };
    (0..STATES).map(&mut at).collect()
}

fn scalar(machine: &Machine, states: &[State<f64>]) {
    let mut workspace = Workspace::new(machine);
    for state in states {
        black_box(evaluate(machine, black_box(state), &mut workspace));
    }
}

fn side_by_side(machine: &Machine, states: &[State<f64>]) -> Vec<State<Lanes>> {
    let packed = |four: &[State<f64>]| {
        let pack = |get: &dyn Fn(&State<f64>) -> f64| {
            Lanes::from_array(std::array::from_fn(|lane| get(&four[lane])))
        };
        let mut state = State::<Lanes>::zero(machine);
        for (k, joint) in state.joints.iter_mut().enumerate() {
            joint.position = pack(&|s| s.joints[k].position);
            joint.rate = pack(&|s| s.joints[k].rate);
            joint.acceleration = pack(&|s| s.joints[k].acceleration);
        }
        for axis in 0..3 {
            state.imu.specific_force[axis] = pack(&|s| s.imu.specific_force[axis]);
            state.imu.angular_velocity[axis] = pack(&|s| s.imu.angular_velocity[axis]);
            state.imu.angular_acceleration[axis] = pack(&|s| s.imu.angular_acceleration[axis]);
        }
        state
    };
    states.chunks_exact(Lanes::COUNT).map(packed).collect()
}

fn lanes(machine: &Machine, states: &[State<Lanes>]) {
    let mut workspace = Workspace::new(machine);
    for state in states {
        black_box(evaluate(machine, black_box(state), &mut workspace));
    }
}

fn nanoseconds_a_state(mut run: impl FnMut()) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..REPEATS {
        let start = Instant::now();
        run();
        least = least.min(start.elapsed().as_secs_f64());
    }
    least * 1e9 / STATES as f64
}

fn peer() {
    let Ok(command) = std::env::var("TIPWATCH_PINOCCHIO") else {
        return;
    };
    let mut words = command.split_whitespace();
    let Some(program) = words.next() else { return };
    match Command::new(program).args(words).output() {
        Ok(output) => println!(
            "Pinocchio rnea:           {}",
            String::from_utf8_lossy(&output.stdout).trim()
        ),
        Err(error) => println!("Pinocchio: {program}: {error}"),
    }
}
