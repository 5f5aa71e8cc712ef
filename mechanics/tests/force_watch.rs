//! Measured forces of the arm, by which nothing is computed, against those that masses and motion require.

use nalgebra::Vector3;
use tipwatch_mechanics::estimation::Estimate;
use tipwatch_mechanics::machine::{LogFacts, MachineSpec, SessionProofs};
use tipwatch_mechanics::state::{Reason, Reasons};
use tipwatch_mechanics::studies::measured_forces::ForceWatch;
use tipwatch_mechanics::{
    Machine, Scope, State, Workspace, actuator_force, evaluate_one, resting_state,
};

use crate::support::set_joint;

const STEP_NS: i64 = 20_000_000;
const FORCE_SIGMA_N: f64 = 500.0;
/// More than five standard deviations of friction (5 %), samples and masses.
const WRONG_BY_N: f64 = 60e3;

/// Returns a machine whose lift cylinder has a measured force and carries a load of this mass (kg); `at_stop`: the boom in its reference
/// posture is at a limit of the URDF.
fn machine(mass: &str, at_stop: bool) -> Machine {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let bound = "name = \"lift\"\nforce = { topic = \"/lift\", field = \"force\" }\nforce_sigma = 500.0\nfriction_share = 0.05\n";
    let text = read("lift_payload.toml").replacen("name = \"lift\"\n", bound, 1)
        + "[[payload]]\nlink = \"tool\"\ncom = [0.405, -0.4313, -0.0134]\nmass = "
        + mass;
    let urdf = read("lift_payload.urdf");
    let lines = urdf
        .lines()
        .map(|line| match line.contains("<joint name='lift' ") {
            true if at_stop => line.replace("lower='-10'", "lower='-1.488'"),
            _ => line.to_owned(),
        });
    let urdf = lines.collect::<Vec<_>>().join("\n");
    let spec = MachineSpec::from_toml(&text, "machine.toml").unwrap();
    spec.check(&urdf, "machine.urdf", LogFacts::default())
        .unwrap()
}

/// What the watch says of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Told {
    time_s: f64,
    is_contradicted: bool,
    is_frozen: bool,
}

/// Watches the lift cylinder while the boom swings (rad); `measured` is the force that its sensor shows, by time (s) and by what the
/// right one would show (N).
fn watched(
    machine: &Machine,
    swing: f64,
    seconds: f64,
    mut measured: impl FnMut(f64, f64) -> f64,
) -> Vec<Told> {
    let mut watch = ForceWatch::new(machine).unwrap();
    let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
    let posture = machine.reference().posture.positions.clone();
    let lift = (machine.joints().iter())
        .position(|joint| joint.name == "lift")
        .unwrap();
    let rows = (seconds * 1e9) as i64 / STEP_NS;
    let rows = (0..rows).map(|row| {
        let time_s = (row * STEP_NS) as f64 * 1e-9;
        let mut state: State<f64> = resting_state(machine, &posture);
        state.imu.specific_force = Vector3::z() * machine.gravity();
        state.payload_share[0] = 1.0;
        let (sin, cos) = (1.5 * time_s).sin_cos();
        let motion = [
            posture[lift] + swing * sin,
            1.5 * swing * cos,
            -2.25 * swing * sin,
        ];
        set_joint(machine, &mut state, "lift", motion);
        evaluate_one(machine, &state, &mut workspace);
        let force = actuator_force(machine, &state, &workspace, 0);
        // of a standard deviation of one, and not periodic
        let noise = 1.4 * (row as f64 * row as f64 * 0.37).sin();
        let friction = 0.05 * force.abs() * cos.signum();
        let mut estimate = Estimate {
            time_ns: row * STEP_NS,
            state,
            reasons: Reasons::NONE,
            rotates: false,
            shown: SessionProofs::NONE,
            stands_on: None,
            measured_loads: Vec::new(),
            commands: Vec::new(),
            lift_forces: vec![f64::NAN],
            arm_forces: vec![measured(time_s, force + FORCE_SIGMA_N * noise + friction)],
        };
        watch.row(machine, &mut estimate);
        let doubt = watch.doubt();
        assert_eq!(
            estimate.reasons.has(Reason::Contradiction),
            doubt.contradicted != 0
        );
        Told {
            time_s,
            is_contradicted: doubt.contradicted == 1,
            is_frozen: doubt.frozen == 1,
        }
    });
    rows.collect()
}

/// The times of the first and the last row that are told (s).
fn span(rows: &[Told], is_told: impl Fn(&Told) -> bool) -> Option<[f64; 2]> {
    let mut told = rows.iter().filter(|row| is_told(row)).map(|row| row.time_s);
    let first = told.next()?;
    Some([first, told.last().unwrap_or(first)])
}

#[test]
fn a_right_force_contradicts_nothing() {
    let rows = watched(&machine("320.0", false), 0.3, 20.0, |_, force| force);
    assert_eq!(
        span(&rows, |row| row.is_contradicted || row.is_frozen),
        None
    );
}

#[test]
fn a_wrong_force_is_doubted_after_two_seconds_until_it_is_right() {
    let rows = watched(&machine("320.0", false), 0.3, 12.0, |time_s, force| {
        let is_wrong = (4.0..8.0).contains(&time_s);
        force + if is_wrong { WRONG_BY_N } else { 0.0 }
    });
    let [from_s, to_s] = span(&rows, |row| row.is_contradicted).unwrap();
    assert!((6.0..6.5).contains(&from_s), "{from_s}");
    assert!((7.7..8.3).contains(&to_s), "{to_s}");
    assert_eq!(span(&rows, |row| row.is_frozen), None);
}

/// What was contradicted stays so while nothing measures it.
#[test]
fn a_missing_force_ends_no_doubt() {
    let rows = watched(
        &machine("320.0", false),
        0.3,
        12.0,
        |time_s, force| match time_s < 8.0 {
            true => force + WRONG_BY_N,
            false => f64::NAN,
        },
    );
    let [from_s, to_s] = span(&rows, |row| row.is_contradicted).unwrap();
    assert!(from_s < 4.0 && to_s > 11.9, "{from_s} {to_s}");
}

/// A sensor that has stopped is told, and doubts no load.
#[test]
fn a_force_that_stands_still_is_told() {
    let mut kept = None;
    let rows = watched(
        &machine("320.0", false),
        0.6,
        12.0,
        |time_s, force| match (4.0..9.0).contains(&time_s) {
            true => *kept.get_or_insert(force),
            false => force,
        },
    );
    let [from_s, to_s] = span(&rows, |row| row.is_frozen).unwrap();
    assert!((6.0..7.0).contains(&from_s), "{from_s}");
    assert!((8.7..9.3).contains(&to_s), "{to_s}");
    assert_eq!(span(&rows, |row| row.is_contradicted), None);
}

/// A cylinder at its stop carries any force.
#[test]
fn a_cylinder_at_its_stop_contradicts_nothing() {
    let wrong = |_: f64, force: f64| force + WRONG_BY_N;
    let rows = watched(&machine("320.0", true), 0.0, 8.0, wrong);
    assert_eq!(span(&rows, |row| row.is_contradicted), None);
    let rows = watched(&machine("320.0", false), 0.0, 8.0, wrong);
    assert!(span(&rows, |row| row.is_contradicted).is_some());
}

/// A force that tells the mass of a payload cannot be checked against it.
#[test]
fn a_force_that_weighs_is_not_watched() {
    assert!(ForceWatch::new(&machine("\"estimate\"", false)).is_none());
}
