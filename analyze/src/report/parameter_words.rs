//! Parameters in words, for sentences: tables keep the names of the output files.

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
    }
}
