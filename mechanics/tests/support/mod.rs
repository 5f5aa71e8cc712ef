//! Shared test support: machines from the files in `data/`.

pub(crate) mod attitude;
pub(crate) mod closed_form;
pub(crate) mod swinging_boom;
pub(crate) mod velocity_gradient;

use std::path::Path;
use std::sync::Arc;

use nalgebra::Vector3;
use proptest::test_runner::{Config, FileFailurePersistence};

use tipwatch_mechanics::machine::{LogFacts, MachineSpec};
use tipwatch_mechanics::{
    Machine, MachineError, Model, Motion, Scope, State, StateColumns, Workspace, evaluate,
    evaluate_rows,
};

/// Returns the settings for so many random cases; one that fails is kept beside the test, and is tried first from then on.
pub(crate) fn cases(cases: u32) -> Config {
    let kept = FileFailurePersistence::WithSource("regressions");
    Config {
        failure_persistence: Some(Box::new(kept)),
        ..Config::with_cases(cases)
    }
}

/// Checks that states evaluated several at a time have the results of each by itself, to the bit.
pub(crate) fn assert_lanes_equal_scalar(
    machine: &Machine,
    states: &mut [State<f64>],
    scope: Scope,
    model: &Arc<Model>,
) {
    let mut columns = StateColumns::unknown(machine, states.len());
    for (row, state) in states.iter_mut().enumerate() {
        columns.set(row, state);
    }
    let lanes = evaluate_rows(machine, &columns, 0..states.len(), scope, model);
    let mut workspace = Workspace::with_model(machine, scope, Arc::clone(model));
    for (row, state) in states.iter().enumerate() {
        let alone = evaluate(machine, state, &mut workspace);
        for (&quantity, column) in lanes.quantities.iter().zip(&lanes.columns) {
            let (a, b) = (column[row], alone.get(quantity));
            let is_same = a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
            assert!(is_same, "row {row}, {quantity:?}: {a} {b}");
        }
    }
}

/// Text of a file in `data/`.
pub(crate) fn data(name: &str) -> String {
    std::fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/data")
            .join(name),
    )
    .unwrap()
}

/// A machine from `data/`, its file edited by `edit`; every joint is measured unless a linkage moves it.
pub(crate) fn edited(name: &str, edit: impl Fn(String) -> String) -> Result<Machine, MachineError> {
    checked(name, edit, LogFacts::default())
}

fn checked(
    name: &str,
    edit: impl Fn(String) -> String,
    facts: LogFacts<'_>,
) -> Result<Machine, MachineError> {
    let spec = MachineSpec::from_toml(&edit(data(&format!("{name}.toml"))), "machine.toml")?;
    spec.check(&data(&format!("{name}.urdf")), "machine.urdf", facts)
}

/// The machine on two actuated bogies, its file edited by `edit`, with the measured joints of its logs: the rods
/// of the suspension and the pivots of the arm.
pub(crate) fn bogie_by_rods(edit: impl Fn(String) -> String) -> Machine {
    let names = [
        "slew",
        "lift",
        "tilt",
        "extension",
        "suspension_right",
        "suspension_left",
        "wheel_fl",
        "wheel_fr",
        "wheel_rl",
        "wheel_rr",
    ]
    .map(String::from);
    let facts = LogFacts {
        joint_names: Some(&names),
        ..LogFacts::default()
    };
    checked("bogie", edit, facts).unwrap()
}

/// A machine from `data/`; every joint is measured unless a linkage moves it.
pub(crate) fn machine(name: &str) -> Machine {
    edited(name, |text| text).unwrap()
}

/// Sets the motion of a joint.
pub(crate) fn set_joint(machine: &Machine, state: &mut State<f64>, name: &str, motion: [f64; 3]) {
    let index = machine
        .joints()
        .iter()
        .position(|joint| joint.name == name)
        .unwrap();
    let [position, rate, acceleration] = motion;
    state.joints[index] = Motion {
        position,
        rate,
        acceleration,
    };
}

/// Index of a wheel.
pub(crate) fn wheel(machine: &Machine, name: &str) -> usize {
    machine
        .wheels()
        .iter()
        .position(|wheel| wheel.name == name)
        .unwrap()
}

/// The machine with six wheels, its file edited by `edit`.
pub(crate) fn six_wheels(edit: impl Fn(String) -> String) -> Machine {
    let text = edit(data("six_wheels.toml"));
    let spec = MachineSpec::from_toml(&text, "six_wheels.toml").unwrap();
    let facts = LogFacts {
        imu_frame: Some("imu_link"),
        ..LogFacts::default()
    };
    spec.check(&data("six_wheels.urdf"), "six_wheels.urdf", facts)
        .unwrap()
}

/// A state with every joint in motion around a working posture.
pub(crate) fn moving(
    machine: &Machine,
    seed: f64,
    force: Vector3<f64>,
    spin: Vector3<f64>,
) -> State<f64> {
    let mut state = State::zero(machine);
    for (k, joint) in machine.joints().iter().enumerate() {
        let phase = seed + 1.7 * k as f64;
        let middle = if ["lift", "tilt"].contains(&joint.name.as_str()) {
            -1.3
        } else {
            0.1
        };
        set_joint(
            machine,
            &mut state,
            &joint.name,
            [
                middle + 0.3 * phase.sin(),
                0.3 * phase.cos(),
                0.5 * (2.0 * phase).sin(),
            ],
        );
    }
    state.imu.specific_force = force;
    state.imu.angular_velocity = spin;
    state.imu.angular_acceleration = spin.yzx();
    state
}

/// Measurement of the six-wheeled machine's IMU, which is mounted upside down.
pub(crate) fn upright(machine: &Machine, force: Vector3<f64>) -> Vector3<f64> {
    machine.imu().body_from_mount.rotation.inverse() * force
}
