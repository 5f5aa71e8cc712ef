//! The motion by the wheels on machines that roll without slip.

use super::super::lean_model::LeanModel;
use super::super::rolling::Rolled;
use super::{bogies, joint, posture, steered};
use crate::machine::Machine;

const RADIUS: f64 = 0.35;
/// Wheels of the steered machine: joint, steering joint, and place relative to the axle that is not steered (m).
const WHEELS: [(&str, Option<&str>, [f64; 2]); 4] = [
    ("wheel_fl", Some("steer_fl"), [2.3, 0.875]),
    ("wheel_fr", Some("steer_fr"), [2.3, -0.875]),
    ("wheel_rl", None, [0.0, 0.875]),
    ("wheel_rr", None, [0.0, -0.875]),
];

fn rolled(machine: &Machine, set: impl FnOnce(&mut LeanModel)) -> Option<Rolled> {
    let mut model = LeanModel::new(machine).unwrap();
    for (joint, position) in posture(machine, 0.0).into_iter().enumerate() {
        model.set(joint, position, 0.0);
    }
    set(&mut model);
    model.lean(0.01, &nalgebra::Vector3::z()).unwrap();
    model.rolled()
}

/// The steered machine turns about a point on its rear axle, with this speed (m/s) and yaw rate (rad/s).
fn curve(speed: f64, turning: f64) -> Rolled {
    let machine = steered();
    let rolled = rolled(&machine, |model| {
        for (wheel, steer, [x, y]) in WHEELS {
            let [along, across] = [speed - turning * y, turning * x];
            let angle = match steer {
                Some(_) if along != 0.0 => (across / along).atan(),
                _ => 0.0,
            };
            if let Some(steer) = steer {
                model.set(joint(&machine, steer), angle, 0.0);
            }
            let rate = (along * angle.cos() + across * angle.sin()) / RADIUS;
            model.set(joint(&machine, wheel), 0.3, rate);
        }
    });
    rolled.unwrap()
}

#[test]
fn straight_travel_has_the_speed_of_its_wheels_and_no_turn() {
    for speed in [-2.0, 0.0, 0.7] {
        let rolled = curve(speed, 0.0);
        assert!((rolled.speed - speed).abs() < 1e-9);
        assert!(rolled.by_speeds.unwrap().abs() < 1e-9);
        assert!(rolled.by_steering.unwrap().abs() < 1e-9);
    }
}

#[test]
fn curves_without_slip_are_found_by_speeds_and_by_steering() {
    for (speed, turning) in [(1.5, 0.2), (1.5, -0.2), (-1.0, 0.15), (0.8, -0.1)] {
        let rolled = curve(speed, turning);
        let off = |found: f64, true_value: f64| (found / true_value - 1.0).abs();
        assert!(off(rolled.speed, speed) < 0.05, "{rolled:?}");
        // the base is midway between the axles
        let velocity = nalgebra::Vector2::new(speed, turning * 0.5 * WHEELS[0].2[0]);
        let apart = (rolled.velocity.unwrap() - velocity).norm();
        assert!(apart < 0.02 * velocity.norm(), "{rolled:?}");
        // The speeds leave the velocity across out.
        assert!(off(rolled.by_speeds.unwrap(), turning) < 0.35, "{rolled:?}");
        assert!(
            off(rolled.by_steering.unwrap(), turning) < 0.05,
            "{rolled:?}"
        );
    }
}

#[test]
fn machine_without_steering_turns_by_the_difference_of_its_sides() {
    let machine = bogies();
    let (speed, turning) = (0.9, 0.3);
    let half_track = |wheel: &str| {
        let spun = machine.joints()[joint(&machine, wheel)].spins_wheel;
        machine.wheels()[spun.unwrap()].centre_at_zero.y
    };
    let rolled = rolled(&machine, |model| {
        for wheel in ["wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"] {
            let rate = (speed - turning * half_track(wheel)) / RADIUS;
            model.set(joint(&machine, wheel), 0.0, rate);
        }
    });
    let rolled = rolled.unwrap();
    assert!(machine.skids() && !steered().skids());
    assert!(rolled.by_steering.is_none());
    assert!((rolled.speed - speed).abs() < 1e-3, "{rolled:?}");
    assert!(
        (rolled.by_speeds.unwrap() - turning).abs() < 1e-3,
        "{rolled:?}"
    );
}

#[test]
fn joints_that_steer_are_known() {
    let machine = steered();
    let found = (0..machine.joints().len()).filter(|&joint| machine.is_steering(joint));
    let names: Vec<&str> = found
        .map(|joint| machine.joints()[joint].name.as_str())
        .collect();
    assert_eq!(names.len(), 2, "{names:?}");
    assert!(
        names.iter().all(|name| name.starts_with("steer")),
        "{names:?}"
    );
    let machine = bogies();
    assert!((0..machine.joints().len()).all(|joint| !machine.is_steering(joint)));
}

#[test]
fn a_wheel_without_velocity_leaves_the_motion_unknown() {
    let machine = steered();
    let wheel = joint(&machine, "wheel_rl");
    assert_eq!(
        rolled(&machine, |model| model.set(wheel, 0.2, f64::NAN)),
        None
    );
    assert!(rolled(&machine, |model| model.set(wheel, 0.2, 0.0)).is_some());
}
