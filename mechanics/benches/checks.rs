//! Cost of the plausibility checks per sample, beside the evaluation of a row.
//!
//! `cargo bench -p tipwatch-mechanics --bench checks`; with a number, so many seconds of signals, for a profiler.
//! The machine stands and its arm works, with noise: the comparisons of sensors with each other run all the time.

#![allow(clippy::print_stdout, reason = "a benchmark prints its result")]

use std::hint::black_box;
use std::time::{Duration, Instant};

use tipwatch_mechanics::estimation::plausibility::Plausibility;
use tipwatch_mechanics::machine::{LogFacts, MachineSpec};
use tipwatch_mechanics::state::{JointStream, Sample, Sensor, Sensors};
use tipwatch_mechanics::{Machine, Scope, State, Workspace, evaluate_one};

/// Seconds of signals without an argument.
const SECONDS: u32 = 600;
/// Samples of each sensor (Hz).
const RATE: u32 = 100;

fn main() {
    let seconds = std::env::args().find_map(|it| it.parse().ok());
    let machine = machine();
    let logged = (0..machine.joints().len()).filter(|&joint| machine.joints()[joint].logged);
    let joints: Vec<usize> = logged.collect();
    let sensors = Sensors {
        joints: vec![JointStream {
            joints: joints.clone(),
        }],
        imu: true,
        odometry: true,
        ..Sensors::default()
    };
    let mut checks = Plausibility::new(&machine, &sensors);
    let mut noise = Noise(7);
    let mut took = [Duration::ZERO; 3];
    let mut findings = 0_usize;
    let samples = seconds.unwrap_or(SECONDS) * RATE;
    for step in 0..samples {
        let time_s = f64::from(step) / f64::from(RATE);
        let all = [
            (
                Sensor::Joints(0),
                arm(&machine, &joints, time_s, &mut noise),
            ),
            (Sensor::Imu, imu(&machine, &mut noise)),
            (Sensor::Odometry, odometry(&mut noise)),
        ];
        for (took, (sensor, values)) in took.iter_mut().zip(&all) {
            let stamp_ns = i64::from(step) * (1_000_000_000 / i64::from(RATE));
            let sample = Sample::new(*sensor, stamp_ns, values);
            let start = Instant::now();
            let judged = black_box(checks.step(black_box(&sample)));
            *took += start.elapsed();
            findings += usize::from(judged.is_ok()) * checks.findings().len();
        }
    }
    let each = took.map(|took| took.as_nanos() as f64 / f64::from(samples));
    let row = evaluation_ns(&machine);
    println!(
        "checks per sample [ns]: joints {:.0}, IMU {:.0}, odometry {:.0}",
        each[0], each[1], each[2]
    );
    println!(
        "checks of the three {:.0} ns, {:.2} of an evaluation of the loads ({row:.0} ns); {findings} findings",
        each.iter().sum::<f64>(),
        each.iter().sum::<f64>() / row
    );
}

fn evaluation_ns(machine: &Machine) -> f64 {
    const TIMES: u32 = 20_000;
    let mut state = State::zero(machine);
    state.imu.specific_force.z = machine.gravity();
    let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
    let start = Instant::now();
    for _ in 0..TIMES {
        black_box(evaluate_one(machine, black_box(&state), &mut workspace));
    }
    start.elapsed().as_nanos() as f64 / f64::from(TIMES)
}

fn arm(machine: &Machine, joints: &[usize], time_s: f64, noise: &mut Noise) -> Vec<f64> {
    let moves = |joint: usize| machine.joints()[joint].spins_wheel.is_none();
    let phase = |joint: usize| 0.8 * time_s + joint as f64;
    let middle = |joint: usize| match machine.joints()[joint].name.as_str() {
        "lift" | "tilt" => -1.3,
        _ => 0.0,
    };
    let swing = |joint: usize| f64::from(u8::from(moves(joint))) * 0.1;
    let position = |&joint: &usize| middle(joint) + swing(joint) * phase(joint).sin();
    let rate = |&joint: &usize| 0.8 * swing(joint) * phase(joint).cos();
    let positions = joints.iter().map(position);
    let mut values: Vec<f64> = positions.chain(joints.iter().map(rate)).collect();
    values
        .iter_mut()
        .for_each(|value| *value += 3e-4 * noise.next());
    values
}

fn imu(machine: &Machine, noise: &mut Noise) -> Vec<f64> {
    let mut values = vec![
        0.0,
        0.0,
        machine.gravity(),
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        1.0,
    ];
    for (index, value) in values[..6].iter_mut().enumerate() {
        *value += if index < 3 { 0.03 } else { 1e-3 } * noise.next();
    }
    values
}

fn odometry(noise: &mut Noise) -> Vec<f64> {
    let mut values = vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    values[..6]
        .iter_mut()
        .for_each(|value| *value += 1e-3 * noise.next());
    values
}

/// Repeatable noise between -1 and 1.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

fn machine() -> Machine {
    let spec = include_str!("../tests/data/rigid.toml");
    let urdf = include_str!("../tests/data/rigid.urdf");
    let spec = MachineSpec::from_toml(spec, "rigid.toml").expect("a machine file");
    spec.check(urdf, "rigid.urdf", LogFacts::default())
        .expect("a machine")
}
