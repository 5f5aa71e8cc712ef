//! Stated standard deviations of signals and parameters, by the machine file.

use super::Machine;
use super::parameter::Parameter;

/// Standard deviation of a signal's systematic error or of a parameter, in its unit.
pub(crate) fn stated_sigma(machine: &Machine, parameter: Parameter) -> f64 {
    let spec = &machine.uncertainty;
    match parameter {
        Parameter::JointPosition(joint) if machine.joints[joint].spins_wheel.is_some() => 0.0,
        Parameter::JointPosition(joint) => {
            let stated = match machine.joint_slides(joint) {
                true => spec.joint_offset_linear,
                false => spec.joint_offset,
            };
            // a guess is at least that uncertain
            stated.max(machine.joints[joint].position_sigma.unwrap_or(0.0))
        }
        Parameter::SpecificForce(_) => spec.accelerometer_bias,
        Parameter::AngularVelocity(_) => spec.gyro_bias,
        Parameter::ToolForce(_) => spec.tool_force,
        Parameter::ToolMoment(_) => spec.tool_moment,
        Parameter::JointVelocity(_)
        | Parameter::JointAcceleration(_)
        | Parameter::AngularAcceleration(_)
        // Part of the variance that the measured torques leave.
        | Parameter::ActuatorForce(_)
        | Parameter::BaseMotion(_) => 0.0,
        Parameter::LinkInertia(link, _) => {
            let stated = spec.inertia_share * parameter.nominal(machine).unwrap_or(0.0).abs();
            // a replacement is at least that uncertain
            stated.max(machine.links[link].inertia_sigma.unwrap_or(0.0))
        }
        Parameter::LinkMass(link) => {
            let link = &machine.links[link];
            let default = spec.mass_share * link.inertia.mass;
            link.sigma.mass_sigma.unwrap_or(default)
        }
        Parameter::LinkCom(link, axis) => {
            let stated = machine.links[link].sigma.com_sigma;
            stated.map_or(spec.com, |sigmas| sigmas[axis as usize])
        }
        Parameter::PayloadMass(payload) => {
            let payload = &machine.payloads[payload];
            let default = spec.payload_mass_share * payload.inertia.mass;
            match payload.is_weighed() {
                true => 0.0,
                false => payload.mass_sigma.unwrap_or(default),
            }
        }
        Parameter::WheelPosition(..) => spec.wheel_position,
        Parameter::WheelRadius(wheel) => {
            let guessed = machine.support(wheel).radius_sigma.unwrap_or(0.0);
            spec.wheel_radius.max(guessed)
        }
        Parameter::ArmPosition(_) => spec.arm_position,
        Parameter::ImuPosition(_) => spec.imu_position,
        Parameter::ImuRotation(_) => spec.imu_rotation,
        Parameter::RollMomentDistribution => spec.roll_moment_distribution,
        Parameter::TyreStiffness(_) => spec.tyre_stiffness_share,
    }
}

impl Parameter {
    /// The key of `[uncertainty]` in the machine file from which the standard deviation of a parameter is; `None` where it is
    /// stated beside the parameter itself, or follows from the signals.
    #[must_use]
    pub fn uncertainty_key(self, machine: &Machine) -> Option<&'static str> {
        Some(match self {
            Self::JointPosition(joint) if machine.joints[joint].position_sigma.is_some() => {
                return None;
            }
            Self::JointPosition(joint) if machine.joint_slides(joint) => "joint_offset_linear",
            Self::JointPosition(_) => "joint_offset",
            Self::SpecificForce(_) => "accelerometer_bias",
            Self::AngularVelocity(_) => "gyro_bias",
            Self::ToolForce(_) => "tool_force",
            Self::ToolMoment(_) => "tool_moment",
            Self::LinkInertia(link, _) if machine.links[link].inertia_sigma.is_none() => {
                "inertia_share"
            }
            Self::LinkMass(link) if machine.links[link].sigma.mass_sigma.is_none() => "mass_share",
            Self::LinkCom(link, _) if machine.links[link].sigma.com_sigma.is_none() => "com",
            Self::PayloadMass(payload)
                if !machine.payloads[payload].is_weighed()
                    && machine.payloads[payload].mass_sigma.is_none() =>
            {
                "payload_mass_share"
            }
            Self::WheelPosition(..) => "wheel_position",
            Self::WheelRadius(wheel) if machine.support(wheel).radius_sigma.is_none() => {
                "wheel_radius"
            }
            Self::ArmPosition(_) => "arm_position",
            Self::ImuPosition(_) => "imu_position",
            Self::ImuRotation(_) => "imu_rotation",
            Self::RollMomentDistribution => "roll_moment_distribution",
            Self::TyreStiffness(_) => "tyre_stiffness_share",
            _ => return None,
        })
    }
}
