//! Validation of the whole-body ground wrench, closed chains included, with Pinocchio's inverse dynamics.
//!
//! `data/make_rnea_reference.py`, which shares no code with this crate, generates `data/rnea_reference.json`.

use std::path::Path;

use nalgebra::Vector3;
use serde_json::Value;
use tipwatch_mechanics::machine::{LogFacts, MachineSpec};
use tipwatch_mechanics::{ImuState, Machine, Motion, State, Workspace, evaluate};

/// Accuracy of the reference, whose closed-chain derivatives are differences.
const ACCURACY: f64 = 1e-8;

fn data(name: &str) -> String {
    std::fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/data")
            .join(name),
    )
    .unwrap()
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_iterator(
        value
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_f64().unwrap()),
    )
}

fn machine(name: &str, measured: &[String]) -> Machine {
    let mut spec = MachineSpec::from_toml(&data(&format!("{name}.toml")), "machine.toml").unwrap();
    spec.imu = None;
    let facts = LogFacts {
        joint_names: Some(measured),
        ..LogFacts::default()
    };
    spec.check(&data(&format!("{name}.urdf")), "machine.urdf", facts)
        .unwrap()
}

#[test]
fn val_ground_wrench_equals_pinocchio() {
    let reference: Value = serde_json::from_str(&data("rnea_reference.json")).unwrap();
    let mut compared = 0;
    for (name, entry) in reference["machines"].as_object().unwrap() {
        for case in entry["cases"].as_array().unwrap() {
            let measured = case["measured"].as_object().unwrap();
            let machine = machine(name, &measured.keys().cloned().collect::<Vec<_>>());
            let mut state = State::<f64>::zero(&machine);
            for (joint, motion) in machine.joints().iter().zip(&mut state.joints) {
                let m = vector(&measured[&joint.name]);
                *motion = Motion {
                    position: m.x,
                    rate: m.y,
                    acceleration: m.z,
                };
            }
            state.imu = ImuState {
                specific_force: vector(&case["specific_force"]),
                angular_velocity: vector(&case["angular_velocity"]),
                angular_acceleration: vector(&case["angular_acceleration"]),
            };
            let mut workspace = Workspace::new(&machine);
            let wrench = evaluate(&machine, &state, &mut workspace).ground_wrench;
            let (force, moment) = (vector(&case["force"]), vector(&case["moment"]));
            assert!(
                (wrench.force - force).norm() <= ACCURACY * force.norm(),
                "{name}: {} {force}",
                wrench.force
            );
            assert!(
                (wrench.moment - moment).norm() <= ACCURACY * moment.norm().max(force.norm()),
                "{name}: {} {moment}",
                wrench.moment
            );
            compared += 1;
        }
    }
    assert_eq!(compared, 8);
}
