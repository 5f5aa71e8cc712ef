//! Time of one evaluation of the simulated machine: fifteen bodies, two closed chains, loads and envelope.
//!
//! `cargo bench -p tipwatch-mechanics`; with the name of a run and a number, only that run so many times, for a
//! profiler. If `TIPWATCH_PINOCCHIO` is set to a program that times Pinocchio's `rnea`
//! on the same bodies (`benches/pinocchio/`), it is run before and after on the same computer.

#![allow(clippy::print_stdout, reason = "a benchmark prints its result")]

use std::hint::black_box;
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

use tipwatch_mechanics::machine::{LogFacts, MachineSpec};
use tipwatch_mechanics::prediction::Predictor;
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::verdict::Level;
use tipwatch_mechanics::{
    BatchWorkspace, Machine, Model, OutcomeColumns, Scope, State, StateColumns, Workspace,
    evaluate_into, evaluate_one,
};

const STATES: usize = 1024;
const REPEATS: usize = 400;

/// Key of the shortest time (ns) in the peer's JSON output.
const RNEA_NS: &str = "\"ns_min\"";

/// A benchmark run: its name and the code to time.
type Run<'a> = (&'a str, Box<dyn FnMut() + 'a>);

/// Names of the runs.
const SCALAR: &str = "scalar";
const SCALAR_FULL: &str = "scalar-full";
const ROWS: &str = "rows";
const FULL: &str = "full";
const INDICATORS: &str = "indicators";
const CAUSES: &str = "causes";
const SENSITIVITIES: &str = "sensitivities";
const PREDICTION: &str = "prediction";

fn main() {
    let machine = machine();
    let states = states(&machine);
    let one_by_one = separate(&machine, &states);
    let model = Arc::new(Model::WholeBody);
    let by_rows = |scope: Scope| {
        let mut workspace = BatchWorkspace::new(&machine, scope, &model);
        let mut outcomes = OutcomeColumns::empty(&machine, scope);
        let (machine, states) = (&machine, &states);
        move || {
            let states = black_box(states);
            evaluate_into(machine, states, 0..STATES, &mut workspace, &mut outcomes);
            black_box(&outcomes);
        }
    };
    let part = |chosen: fn(&mut Scope)| {
        let mut scope = Scope::LOADS;
        chosen(&mut scope);
        by_rows(scope)
    };
    let mut predictor = Predictor::new(&machine);
    let mut runs: [Run<'_>; 8] = [
        (
            SCALAR,
            Box::new(|| scalar(&machine, &one_by_one, Scope::LOADS)),
        ),
        (
            SCALAR_FULL,
            Box::new(|| scalar(&machine, &one_by_one, Scope::ALL)),
        ),
        (ROWS, Box::new(by_rows(Scope::LOADS))),
        (FULL, Box::new(by_rows(Scope::ALL))),
        (INDICATORS, Box::new(part(|scope| scope.indicators = true))),
        (CAUSES, Box::new(part(|scope| scope.contributions = true))),
        (
            SENSITIVITIES,
            Box::new(part(|scope| scope.sensitivities = true)),
        ),
        (
            PREDICTION,
            Box::new(|| {
                for state in &one_by_one {
                    let state = black_box(state);
                    black_box(predictor.predict(&machine, state, Reasons::NONE, Level::Safe));
                }
            }),
        ),
    ];
    let mut arguments = std::env::args()
        .skip(1)
        .filter(|word| !word.starts_with('-'));
    if let Some(only) = arguments.next() {
        let repeats = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(1);
        let (_, run) = (runs.iter_mut().find(|(name, _)| *name == only)).expect("a known name");
        (0..repeats).for_each(|_| run());
        return;
    }
    let before = peer();
    let least = nanoseconds_a_state(&mut runs);
    let of = |name: &str| {
        least[runs
            .iter()
            .position(|(known, _)| *known == name)
            .expect("known")]
    };
    println!("Minimum of {REPEATS} interleaved runs over {STATES} states, ns a sample:");
    println!("loads, f64                          {:7.0}", of(SCALAR));
    println!(
        "full scope, f64                     {:7.0}",
        of(SCALAR_FULL)
    );
    println!("loads, from columns to columns      {:7.0}", of(ROWS));
    println!("full scope, from columns to columns {:7.0}", of(FULL));
    println!(
        "the rest beside the loads: {:.2} times the loads",
        (of(FULL) - of(ROWS)) / of(ROWS)
    );
    for name in [INDICATORS, CAUSES, SENSITIVITIES] {
        println!(
            "  {name:15} {:7.0} more than the loads alone",
            of(name) - of(ROWS)
        );
    }
    println!(
        "prediction by three motions, {} instants {:7.0}, {:.1} times the full scope, f64",
        machine.prediction().points,
        of(PREDICTION),
        of(PREDICTION) / of(SCALAR_FULL)
    );
    println!("figure loads-vs-everything {:.4}", of(ROWS) / of(FULL));
    // the quicker of both runs: others may use the machine
    if let Some(rnea_ns) = [before, peer()].into_iter().flatten().reduce(f64::min) {
        println!("figure loads-vs-rnea {:.3}", rnea_ns / of(ROWS));
    }
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
        let tilt = 0.05 * phase.cos();
        state.base.up = nalgebra::Vector3::new(tilt.sin(), 0.0, tilt.cos());
        state.base.velocity = nalgebra::Vector3::new(phase.cos(), 0.02 * phase.sin(), 0.0);
        state.base.velocity_rate = nalgebra::Vector3::new(0.3 * phase.sin(), 0.0, 0.0);
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

fn scalar(machine: &Machine, states: &[State<f64>], scope: Scope) {
    let mut workspace = Workspace::with_scope(machine, scope);
    for state in states {
        black_box(evaluate_one(machine, black_box(state), &mut workspace));
    }
}

/// The least time of each run, all of them in turn.
fn nanoseconds_a_state(runs: &mut [Run<'_>]) -> Vec<f64> {
    let mut least = vec![f64::INFINITY; runs.len()];
    for _ in 0..REPEATS {
        for ((_, run), least) in runs.iter_mut().zip(&mut least) {
            let start = Instant::now();
            run();
            let took_s = start.elapsed().as_secs_f64();
            *least = least.min(took_s * 1e9 / STATES as f64);
        }
    }
    least
}

/// Runs Pinocchio's `rnea` if it is there; its time (ns a sample).
fn peer() -> Option<f64> {
    let command = std::env::var("TIPWATCH_PINOCCHIO").ok()?;
    let mut words = command.split_whitespace();
    let program = words.next()?;
    match Command::new(program).args(words).output() {
        Ok(output) => {
            let told = String::from_utf8_lossy(&output.stdout);
            println!("Pinocchio rnea:           {}", told.trim());
            let rest = told.split_once(RNEA_NS)?.1;
            let number = rest.trim_start_matches([':', ' ']);
            let end = number.find([',', '}']).unwrap_or(number.len());
            number[..end].trim().parse().ok()
        }
        Err(error) => {
            println!("Pinocchio: {program}: {error}");
            None
        }
    }
}
