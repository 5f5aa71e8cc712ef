//! Tests of what the checks are made of, on machines of the test data.

mod excitation;
mod inclination;
mod lean;
mod lean_model;
mod motion;
mod rolling;

use crate::machine::Machine;
use crate::machine::of_tests::{checked, rigid as steered, rigid_with};

/// A machine on two actuated bogies, without steering.
fn bogies() -> Machine {
    checked(
        include_str!("../../../../../tests/data/bogie.toml"),
        include_str!("../../../../../tests/data/bogie.urdf"),
    )
}

/// Index of a joint.
fn joint(machine: &Machine, name: &str) -> usize {
    let is_it = |joint: &crate::machine::MeasuredJoint| joint.name == name;
    machine.joints().iter().position(is_it).unwrap()
}

/// A posture: the arm raised and folded halfway, its slew at an angle (rad), all other joints at zero.
fn posture(machine: &Machine, slew: f64) -> Vec<f64> {
    let position = |name: &str| match name {
        "slew" => slew,
        "lift" => -1.3,
        "tilt" => -1.4,
        "extension" => 0.4,
        _ => 0.0,
    };
    let joints = machine.joints().iter();
    joints.map(|joint| position(&joint.name)).collect()
}
