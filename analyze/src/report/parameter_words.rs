//! Parameters and their stated uncertainties in words: people do not read the names of output and machine files.

use tipwatch_language::{message, say, told, word};
use tipwatch_mechanics::Parameter;
use tipwatch_mechanics::machine::Machine;

/// Names the parameter, in words that follow "the": "mass of tool", "position of joint slew".
pub(super) fn in_words(parameter: Parameter, machine: &Machine) -> String {
    let joint = |joint: usize| say!("joint {}", machine.joints()[joint].name);
    let link = |link: usize| machine.links()[link].name.clone();
    // "wheel_fr.radius": the name of the wheel in lower case, as all names of parameters
    let name = parameter.name(machine);
    let wheel = || {
        let key = name.trim_start_matches("wheel_");
        let key = key.split('.').next().unwrap_or_default();
        let found = machine.wheel_named(key);
        found.map_or_else(
            || key.to_uppercase(),
            |wheel| machine.wheels()[wheel].name.clone(),
        )
    };
    match parameter {
        Parameter::JointPosition(j) => say!("position of {}", joint(j)),
        Parameter::JointVelocity(j) => say!("velocity of {}", joint(j)),
        Parameter::JointAcceleration(j) => say!("acceleration of {}", joint(j)),
        Parameter::SpecificForce(axis) => {
            say!("accelerometer along the {} axis of the IMU", axis.name())
        }
        Parameter::AngularVelocity(axis) => {
            say!("gyro about the {} axis of the IMU", axis.name())
        }
        Parameter::AngularAcceleration(axis) => {
            say!(
                "angular acceleration about the {} axis of the IMU",
                axis.name()
            )
        }
        Parameter::ToolForce(axis) => say!("force on the tool along {}", axis.name()),
        Parameter::ToolMoment(axis) => say!("moment on the tool about {}", axis.name()),
        Parameter::ActuatorForce(_) => word!("measured force of an actuator").into(),
        Parameter::LinkMass(l) => say!("mass of {}", link(l)),
        Parameter::LinkCom(l, axis) => {
            say!("centre of mass of {} along {}", link(l), axis.name())
        }
        Parameter::LinkInertia(l, _) => say!("inertia of {}", link(l)),
        Parameter::PayloadMass(p) => match machine.payloads().len() {
            1 => word!("mass of the payload").into(),
            _ => say!("mass of payload {}", p + 1),
        },
        Parameter::WheelPosition(_, axis) => {
            say!("position of {} along {}", wheel(), axis.name())
        }
        Parameter::WheelRadius(_) => say!("radius of {}", wheel()),
        Parameter::ArmPosition(axis) => say!("position of the arm along {}", axis.name()),
        Parameter::ImuPosition(axis) => say!("position of the IMU along {}", axis.name()),
        Parameter::ImuRotation(axis) => say!("mounting angle of the IMU about {}", axis.name()),
        Parameter::RollMomentDistribution => {
            word!("share of the front axle in the difference between the sides").into()
        }
        Parameter::TyreStiffness(_) => say!("tyre stiffness of {}", wheel()),
        Parameter::BaseMotion(_) => word!("measured motion of the base").into(),
    }
}

/// Names the quantity whose standard deviation a key of the machine file's uncertainties states, and its unit. A key that is not
/// known here stands as it is.
pub(crate) fn uncertainty_in_words(key: &str) -> (&str, &'static str) {
    match key {
        "mass_share" => (word!("mass of a link"), told(SHARE)),
        "com" => (word!("centre of mass of a link, along each axis"), "m"),
        "inertia_share" => (word!("inertia of a link"), told(SHARE)),
        "payload_mass_share" => (word!("mass of a payload"), told(SHARE)),
        "wheel_position" => (
            word!("position of a wheel or other support, along each axis"),
            "m",
        ),
        "wheel_radius" => (word!("radius of a wheel"), "m"),
        "arm_position" => (word!("position of the arm's root, along each axis"), "m"),
        "joint_offset" => (
            word!("systematic error of a revolute joint's position"),
            "rad",
        ),
        "joint_offset_linear" => (
            word!("systematic error of a prismatic joint's position"),
            "m",
        ),
        "imu_position" => (word!("position of the IMU, along each axis"), "m"),
        "imu_rotation" => (word!("mounting angle of the IMU, about each axis"), "rad"),
        "accelerometer_bias" => (word!("bias of the accelerometer, along each axis"), "m/s²"),
        "gyro_bias" => (word!("bias of the gyro, about each axis"), "rad/s"),
        "attitude_bias" => (word!("constant error of roll and pitch"), "rad"),
        "gravity" => (word!("local gravity"), "m/s²"),
        "tool_force" => (
            word!("systematic error of the force on the tool, along each axis"),
            "N",
        ),
        "tool_moment" => (
            word!("systematic error of the moment on the tool, about each axis"),
            "N m",
        ),
        "roll_moment_distribution" => (
            word!("share of the front axle in the difference between the sides"),
            told(SHARE),
        ),
        "tyre_stiffness_share" => (word!("stiffness of a tyre"), told(SHARE)),
        "model_share" => (
            word!("what the model leaves out, as a share of the mean load"),
            told(SHARE),
        ),
        key => (key, ""),
    }
}

/// A unit of a table as a reader reads it: that of what is relative is a word.
pub(super) fn unit_in_words(unit: &'static str) -> &'static str {
    match unit {
        "-" => told(SHARE),
        unit => unit,
    }
}

/// Of what is relative.
const SHARE: &str = message!("share");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_parameter_has_the_name_of_a_table_in_a_sentence() {
        let machine = crate::base::rigid::rigid();
        for parameter in Parameter::all(&machine) {
            let words = in_words(parameter, &machine);
            assert_ne!(words, parameter.name(&machine));
            assert!(!words.contains('.') && words.contains(' '), "{words}");
        }
        for (key, _) in machine.uncertainty().by_key() {
            let (words, unit) = uncertainty_in_words(key);
            assert!(words != key && !unit.is_empty(), "{key}");
        }
    }
}
