//! Unit, nominal value and stated uncertainty of every parameter.

use super::parameter::Parameter;
use super::stated_sigma::stated_sigma;
use super::{Identified, Machine, Mounting, Split, Unknown};

impl Parameter {
    /// Unit of the parameter.
    #[must_use]
    pub fn unit(self, machine: &Machine) -> &'static str {
        let of_joint = |joint: usize, turning, sliding| {
            if machine.joint_slides(joint) {
                sliding
            } else {
                turning
            }
        };
        match self {
            Self::JointPosition(joint) => of_joint(joint, "rad", "m"),
            Self::JointVelocity(joint) => of_joint(joint, "rad/s", "m/s"),
            Self::JointAcceleration(joint) => of_joint(joint, "rad/s^2", "m/s^2"),
            Self::SpecificForce(_) => "m/s^2",
            Self::AngularVelocity(_) => "rad/s",
            Self::AngularAcceleration(_) => "rad/s^2",
            Self::ToolForce(_) | Self::ActuatorForce(_) => "N",
            Self::ToolMoment(_) => "N m",
            Self::LinkMass(_) | Self::PayloadMass(_) => "kg",
            Self::LinkInertia(..) => "kg m^2",
            Self::LinkCom(..)
            | Self::WheelPosition(..)
            | Self::WheelRadius(_)
            | Self::ArmPosition(_)
            | Self::ImuPosition(_) => "m",
            Self::ImuRotation(_) => "rad",
            Self::RollMomentDistribution | Self::TyreStiffness(_) => "-",
            Self::BaseMotion(travel) => travel.unit(),
        }
    }

    /// Nominal value in the machine; `None` for signals, and where only a change is meaningful.
    #[must_use]
    pub fn nominal(self, machine: &Machine) -> Option<f64> {
        match self {
            Self::LinkMass(link) => Some(machine.links[link].inertia.mass),
            Self::LinkCom(link, axis) => {
                let link = &machine.links[link];
                let com = link.body_from_link.inverse() * nalgebra::Point3::from(link.inertia.com);
                Some(com[axis as usize])
            }
            Self::LinkInertia(link, element) => {
                let link = &machine.links[link];
                let rotation = link.body_from_link.rotation.to_rotation_matrix();
                let tensor =
                    rotation.matrix().transpose() * link.inertia.about_com * rotation.matrix();
                Some(tensor[element.place()])
            }
            Self::PayloadMass(payload) => Some(machine.payloads[payload].inertia.mass),
            Self::WheelPosition(wheel, axis) => {
                let wheel = machine.support(wheel);
                let place = if wheel.body == wheel.mounting.carrier {
                    wheel.centre_in_body
                } else {
                    machine.bodies[wheel.body].joint_in_parent
                };
                Some(in_mounting(&wheel.mounting, &place)[axis as usize])
            }
            Self::WheelRadius(wheel) => Some(machine.support(wheel).radius),
            Self::ArmPosition(axis) => {
                let (mounting, root) = (machine.arm_mounting.as_ref()?, machine.arm_root.as_ref()?);
                let place = if root.body == mounting.carrier {
                    root.body_from_mount.translation.vector
                } else {
                    machine.bodies[root.body].joint_in_parent
                };
                Some(in_mounting(mounting, &place)[axis as usize])
            }
            Self::ImuPosition(axis) => {
                Some(machine.imu.body_from_mount.translation.vector[axis as usize])
            }
            Self::RollMomentDistribution => match machine.contact.split {
                Split::RollMomentDistribution { share, .. } => Some(share),
                Split::Springs => machine.supports.rule_of_other_sets(),
            },
            Self::ImuRotation(_)
            | Self::TyreStiffness(_)
            | Self::JointPosition(_)
            | Self::JointVelocity(_)
            | Self::JointAcceleration(_)
            | Self::SpecificForce(_)
            | Self::AngularVelocity(_)
            | Self::AngularAcceleration(_)
            | Self::ToolForce(_)
            | Self::ToolMoment(_)
            | Self::ActuatorForce(_)
            | Self::BaseMotion(_) => None,
        }
    }

    /// Standard deviation, in its unit, identified, from the machine file or by default; for a signal, that of its systematic
    /// error.
    #[must_use]
    pub fn sigma(self, machine: &Machine) -> f64 {
        let unknown = Unknown::Parameter(self);
        let identified = machine.identified.as_ref();
        let identified = identified.and_then(|identified| match self {
            // one factor for all of its elements
            Self::LinkInertia(link, _) => {
                let share = identified.sigma(Unknown::Inertia(link))?;
                Some(share * self.nominal(machine)?.abs())
            }
            _ if !Identified::is_in_bands(unknown) => None,
            _ => identified.sigma(unknown),
        });
        identified.unwrap_or_else(|| stated_sigma(machine, self))
    }
}

/// A position in the carrier, expressed in the axes of the mount.
fn in_mounting(mounting: &Mounting, place: &nalgebra::Vector3<f64>) -> nalgebra::Vector3<f64> {
    mounting.carrier_from_axes.transpose() * place
}
