//! The row of a monitor without its messages: estimate, evaluation with everything, prediction.
//!
//! `cargo bench -p tipwatch-mechanics --bench tick`; with a number, only the whole row so many times, for a profiler. A machine at
//! work sends joint states, IMU and odometry a thousand times a second. `tipwatch-live`'s benchmark `latency` has the messages, too.

#![allow(clippy::print_stdout, reason = "a benchmark prints its result")]

use std::hint::black_box;
use std::time::Instant;

use tipwatch_mechanics::estimation::{CausalEstimator, RowClock};
use tipwatch_mechanics::machine::{LogFacts, MachineSpec};
use tipwatch_mechanics::prediction::{PacedPredictor, Predictor};
use tipwatch_mechanics::state::{JointStream, Sample, Sensor, Sensors};
use tipwatch_mechanics::verdict::Level;
use tipwatch_mechanics::{Machine, Scope, Workspace, evaluate_one};

const ROWS: usize = 2000;
const REPEATS: usize = 40;
const PERIOD_NS: i64 = 1_000_000;

/// The last stage of the work on a row that a run includes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Estimate,
    Evaluation,
    /// The prediction as the monitor paces it.
    Paced,
    /// The prediction of every row.
    Predicted,
}

fn main() {
    let machine = machine();
    let mut words = std::env::args()
        .skip(1)
        .filter_map(|word| word.parse::<usize>().ok());
    if let Some(repeats) = words.next() {
        for _ in 0..repeats {
            run(&machine, Part::Paced);
        }
        return;
    }
    let parts = [
        (Part::Estimate, "estimate with its checks"),
        (Part::Evaluation, "and evaluation with everything"),
        (Part::Paced, "and prediction as the monitor paces it"),
        (Part::Predicted, "and prediction of every row"),
    ];
    let mut medians = parts.map(|_| Vec::new());
    for _ in 0..REPEATS {
        for ((part, _), medians) in parts.iter().zip(&mut medians) {
            medians.push(run(&machine, *part));
        }
    }
    println!(
        "Least of {REPEATS} interleaved runs of {ROWS} rows, ns a row: median, 90 %, 99 %, mean"
    );
    for ((_, name), runs) in parts.iter().zip(&medians) {
        let least = |k: usize| runs.iter().map(|run| run[k]).fold(f64::INFINITY, f64::min);
        println!(
            "{name:45} {:7.0} {:7.0} {:7.0} {:7.0}",
            least(0),
            least(1),
            least(2),
            least(3)
        );
    }
}

/// Median, 90 %, 99 % and mean of the times of the rows (ns).
fn run(machine: &Machine, part: Part) -> [f64; 4] {
    let joints: Vec<usize> = (0..machine.joints().len())
        .filter(|&joint| machine.joints()[joint].logged)
        .collect();
    let sensors = Sensors {
        joints: vec![JointStream {
            joints: joints.clone(),
        }],
        imu: true,
        odometry: true,
        ..Sensors::default()
    };
    let mut estimator = CausalEstimator::new(machine, &sensors, RowClock::JointStates);
    let mut workspace = Workspace::with_scope(machine, Scope::ALL);
    let (mut paced, mut predictor) = (PacedPredictor::new(machine), Predictor::new(machine));
    let mut times = Vec::with_capacity(ROWS);
    let mut values = vec![0.0; 2 * joints.len()];
    for row in 0..ROWS {
        let time_ns = 1_000_000_000 + row as i64 * PERIOD_NS;
        let phase = row as f64 * 1e-3;
        let noise = |k: usize| ((row * 7919 + k * 104_729) % 1000) as f64 * 1e-6 - 5e-4;
        for (place, &joint) in joints.iter().enumerate() {
            let name = machine.joints()[joint].name.as_str();
            let [middle, reach] = match name {
                "lift" | "tilt" => [-1.3, 0.1],
                "extension" => [0.2, 0.05],
                "slew" => [0.0, 0.3],
                _ => [0.0, 0.0],
            };
            values[place] = middle + reach * phase.sin() + 1e-2 * noise(place);
            values[joints.len() + place] = reach * phase.cos() + noise(place);
        }
        let imu = [
            noise(1),
            noise(2),
            9.80665 + noise(3),
            noise(4),
            noise(5),
            noise(6),
            0.0,
            0.0,
            0.0,
            1.0,
        ];
        let odometry = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let mut push = |sensor, values: &[f64]| {
            let sample = Sample::new(sensor, time_ns, values);
            // a sample that is not used costs no less
            let _ = estimator.push(machine, black_box(&sample), &mut |_| {});
        };
        push(Sensor::Odometry, &odometry);
        push(Sensor::Imu, &imu);
        let start = Instant::now();
        push(Sensor::Joints(0), &values);
        let estimate = estimator.last();
        if part >= Part::Evaluation {
            let outcome = evaluate_one(machine, &estimate.state, &mut workspace);
            let reasons = estimate.reasons.with_outcome(outcome);
            let state = &estimate.state;
            match part {
                Part::Paced => {
                    black_box(paced.row(machine, time_ns, state, reasons, Level::Safe));
                }
                Part::Predicted => {
                    black_box(predictor.predict(machine, state, reasons, Level::Safe));
                }
                _ => {}
            }
            black_box(workspace.outcome());
        }
        times.push(start.elapsed().as_nanos() as f64);
    }
    // the first rows have not seen every sensor
    let mut times = times.split_off(ROWS / 10);
    times.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| times[(share * (times.len() - 1) as f64) as usize];
    let mean = times.iter().sum::<f64>() / times.len() as f64;
    [at(0.5), at(0.9), at(0.99), mean]
}

fn machine() -> Machine {
    let spec = MachineSpec::from_toml(include_str!("../tests/data/rigid.toml"), "rigid.toml")
        .expect("a valid machine file");
    let urdf = include_str!("../tests/data/rigid.urdf");
    let mut machine = spec
        .check(urdf, "rigid.urdf", LogFacts::default())
        .expect("a valid machine");
    machine
        .set_reference_loads()
        .expect("loads of the reference posture");
    machine
}
