//! Validation of T*, below which the second paper's problem moves the rods the wrong way, with Pinocchio.

use crate::support::{bogie, data};
use serde_json::Value;
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::machine::{ControlMode, SuspensionControl};
use tipwatch_suspension::{SuspensionError, SuspensionOptimiser};

fn postures(machine: &Machine) -> Vec<(Vec<f64>, f64, [f64; 3])> {
    let reference: Value = serde_json::from_str(&data("critical_step_reference.json")).unwrap();
    let posture = |case: &Value| {
        let of = |name: &str| case["arm"][name].as_f64().unwrap_or(0.0);
        let joints = machine.joints().iter().map(|joint| of(&joint.name));
        let numbers =
            ["by_position", "by_acceleration", "time"].map(|key| case[key].as_f64().unwrap());
        (joints.collect(), case["rod"].as_f64().unwrap(), numbers)
    };
    reference.as_array().unwrap().iter().map(posture).collect()
}

#[test]
fn val_critical_step_equals_pinocchio() {
    let machine = bogie(|text| text.replace("tyre_stiffness = 8.0e5\n", "")).unwrap();
    let postures = postures(&machine);
    let mut optimiser =
        SuspensionOptimiser::new(&machine, &SuspensionControl::default(), &postures[0].0).unwrap();
    for (joints, rod, [by_position, by_acceleration, time]) in &postures {
        let found = optimiser.critical_step(joints, *rod);
        let near = |a: f64, b: f64, share: f64| (a - b).abs() < share * b.abs();
        assert!(
            near(found.front_less_rear_by_position, *by_position, 1e-5),
            "{found:?} {by_position}"
        );
        assert!(
            near(
                found.front_less_rear_by_acceleration,
                *by_acceleration,
                1e-4
            ),
            "{found:?} {by_acceleration}"
        );
        // The cost contains pairs of wheels, not only front and rear.
        assert!(near(found.time.unwrap(), *time, 1e-3), "{found:?} {time}");
    }
    // Arm to the side, back, forward, far forward, with the cylinders at mid-stroke.
    let middle: Vec<f64> = postures
        .iter()
        .filter(|(_, rod, _)| *rod == -0.1)
        .map(|(joints, rod, _)| optimiser.critical_step(joints, *rod).time.unwrap())
        .collect();
    for (found, expected) in middle.iter().zip([0.52, 0.69, 0.81, 0.99, 0.97]) {
        assert!((found - expected).abs() < 0.005, "{middle:?}");
    }
}

#[test]
fn one_step_mode_rejects_steps_below_critical() {
    let machine = bogie(|text| text).unwrap();
    let joints = &postures(&machine)[0].0;
    let control = |rate: f64| SuspensionControl {
        mode: ControlMode::OneStep,
        rate,
        ..SuspensionControl::default()
    };
    let refused = |rate: f64| match SuspensionOptimiser::new(&machine, &control(rate), joints) {
        Err(SuspensionError::StepTooShort {
            least_step,
            critical,
            ..
        }) => {
            assert!((least_step - 1.5 * critical).abs() < 1e-12);
            assert!((0.5..0.6).contains(&critical), "{critical}");
            least_step
        }
        other => panic!("{other:?}"),
    };
    let least_step = refused(50.0);
    refused(1.001 / least_step);
    SuspensionOptimiser::new(&machine, &control(0.999 / least_step), joints).unwrap();
    let message = SuspensionOptimiser::new(&machine, &control(50.0), joints)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("suspension.control.rate") && message.contains("found 0.020 s"),
        "{message}"
    );
}
