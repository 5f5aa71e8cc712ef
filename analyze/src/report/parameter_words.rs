//! Parameters and their stated uncertainties in words: people do not read the names of output and machine files.

use tipwatch_mechanics::Parameter;
use tipwatch_mechanics::machine::Machine;

/// What the parameter is, in words that follow "the": "mass of tool", "position of joint slew".
pub(super) fn in_words(parameter: Parameter, machine: &Machine) -> String {
    let joint = |joint: usize| format!("joint {}", machine.joints()[joint].name);
    let link = |link: usize| machine.links()[link].name.clone();
    // "wheel_fr.radius": the name of the wheel in lower case, as all names of parameters
    let name = parameter.name(machine);
    let wheel = || {
        let key = name.trim_start_matches("wheel_");
        let key = key.split('.').next().unwrap_or_default();
        let mut wheels = machine.wheels().iter().map(|wheel| &wheel.name);
        let found = wheels.find(|name| name.to_lowercase() == key);
        found.map_or_else(|| key.to_uppercase(), Clone::clone)
    };
    let payload = |payload: usize| match machine.payloads().len() {
        1 => "the payload".to_string(),
        _ => format!("payload {}", payload + 1),
    };
    match parameter {
        Parameter::JointPosition(j) => format!("position of {}", joint(j)),
        Parameter::JointVelocity(j) => format!("velocity of {}", joint(j)),
        Parameter::JointAcceleration(j) => format!("acceleration of {}", joint(j)),
        Parameter::SpecificForce(axis) => {
            format!("accelerometer along the {} axis of the IMU", axis.name())
        }
        Parameter::AngularVelocity(axis) => {
            format!("gyro about the {} axis of the IMU", axis.name())
        }
        Parameter::AngularAcceleration(axis) => {
            format!(
                "angular acceleration about the {} axis of the IMU",
                axis.name()
            )
        }
        Parameter::ToolForce(axis) => format!("force on the tool along {}", axis.name()),
        Parameter::ToolMoment(axis) => format!("moment on the tool about {}", axis.name()),
        Parameter::ActuatorForce(_) => "measured force of an actuator".into(),
        Parameter::LinkMass(l) => format!("mass of {}", link(l)),
        Parameter::LinkCom(l, axis) => {
            format!("centre of mass of {} along {}", link(l), axis.name())
        }
        Parameter::LinkInertia(l, _) => format!("inertia of {}", link(l)),
        Parameter::PayloadMass(p) => format!("mass of {}", payload(p)),
        Parameter::WheelPosition(_, axis) => {
            format!("position of {} along {}", wheel(), axis.name())
        }
        Parameter::WheelRadius(_) => format!("radius of {}", wheel()),
        Parameter::ArmPosition(axis) => format!("position of the arm along {}", axis.name()),
        Parameter::ImuPosition(axis) => format!("position of the IMU along {}", axis.name()),
        Parameter::ImuRotation(axis) => format!("mounting angle of the IMU about {}", axis.name()),
        Parameter::RollMomentDistribution => {
            "share of the front axle in the difference between the sides".into()
        }
        Parameter::TyreStiffness(_) => format!("tyre stiffness of {}", wheel()),
        Parameter::BaseMotion(_) => "measured motion of the base".into(),
    }
}

/// What a key of the machine file's uncertainties is the standard deviation of, and its unit. A key that is not known here
/// stands as it is.
pub(super) fn uncertainty_in_words(key: &str) -> (&str, &'static str) {
    match key {
        "mass_share" => ("mass of a link", SHARE),
        "com" => ("centre of mass of a link, along each axis", "m"),
        "inertia_share" => ("inertia of a link", SHARE),
        "payload_mass_share" => ("mass of a payload", SHARE),
        "wheel_position" => ("position of a wheel or other support, along each axis", "m"),
        "wheel_radius" => ("radius of a wheel", "m"),
        "arm_position" => ("position of the arm's root, along each axis", "m"),
        "joint_offset" => ("systematic error of a revolute joint's position", "rad"),
        "joint_offset_linear" => ("systematic error of a prismatic joint's position", "m"),
        "imu_position" => ("position of the IMU, along each axis", "m"),
        "imu_rotation" => ("mounting angle of the IMU, about each axis", "rad"),
        "accelerometer_bias" => ("bias of the accelerometer, along each axis", "m/s²"),
        "gyro_bias" => ("bias of the gyro, about each axis", "rad/s"),
        "attitude_bias" => ("constant error of roll and pitch", "rad"),
        "gravity" => ("local gravity", "m/s²"),
        "tool_force" => (
            "systematic error of the force on the tool, along each axis",
            "N",
        ),
        "tool_moment" => (
            "systematic error of the moment on the tool, about each axis",
            "N m",
        ),
        "roll_moment_distribution" => (
            "share of the front axle in the difference between the sides",
            SHARE,
        ),
        "tyre_stiffness_share" => ("stiffness of a tyre", SHARE),
        "model_share" => (
            "what the model leaves out, as a share of the mean load",
            SHARE,
        ),
        key => (key, ""),
    }
}

/// Of what is relative.
const SHARE: &str = "share";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_parameter_has_the_name_of_a_table_in_a_sentence() {
        let text = include_str!("../../../mechanics/tests/data/rigid.toml");
        let spec = tipwatch_mechanics::MachineSpec::from_toml(text, "rigid.toml").unwrap();
        let urdf = include_str!("../../../mechanics/tests/data/rigid.urdf");
        let machine = spec.check(urdf, "rigid.urdf", Default::default()).unwrap();
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
