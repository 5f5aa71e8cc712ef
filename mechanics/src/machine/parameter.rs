//! Signals and parameters with respect to which the loads can be differentiated, with their names.

use super::travel::BaseMotion;
use super::{Machine, Split};

/// An axis of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axis {
    /// The first.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
}

/// An element of an inertia tensor (not a product of inertia: I_xy = -sum m x y).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum InertiaElement {
    /// I_xx
    Xx,
    /// I_yy
    Yy,
    /// I_zz
    Zz,
    /// I_xy = I_yx
    Xy,
    /// I_xz = I_zx
    Xz,
    /// I_yz = I_zy
    Yz,
}

/// A signal, or a parameter of the machine. Indices refer to the machine's lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// Position of a measured joint, equivalently the offset of its encoder (rad or m).
    JointPosition(usize),
    /// Velocity of a measured joint (rad/s or m/s).
    JointVelocity(usize),
    /// Acceleration of a measured joint (rad/s^2 or m/s^2).
    JointAcceleration(usize),
    /// Specific force in the IMU frame, equivalently the accelerometer's bias (m/s^2).
    SpecificForce(Axis),
    /// Angular velocity in the IMU frame, equivalently the gyro's bias (rad/s).
    AngularVelocity(Axis),
    /// Angular acceleration in the IMU frame (rad/s^2).
    AngularAcceleration(Axis),
    /// Force on the tool, in the tool's frame (N).
    ToolForce(Axis),
    /// Moment on the tool, in the tool's frame (N m).
    ToolMoment(Axis),
    /// Force of the actuator of an actuated joint (N).
    ActuatorForce(usize),
    /// Mass of a link at constant centre of mass and inertia about it (kg).
    LinkMass(usize),
    /// Centre of mass of a link, in the link's frame (m).
    LinkCom(usize, Axis),
    /// Inertia of a link about its centre of mass, in the link's axes (kg m^2).
    LinkInertia(usize, InertiaElement),
    /// Mass of a payload (kg).
    PayloadMass(usize),
    /// Position of a wheel on the link that carries it, in that link's axes (m).
    WheelPosition(usize, Axis),
    /// Unloaded radius of a wheel (m).
    WheelRadius(usize),
    /// Position of the arm on the link that carries it, in that link's axes (m).
    ArmPosition(Axis),
    /// Position of the IMU, in the axes of its body (m).
    ImuPosition(Axis),
    /// Small rotation of the IMU about an axis of its body (rad).
    ImuRotation(Axis),
    /// Roll moment distribution: D of assumption 8 of the first paper (dimensionless).
    RollMomentDistribution,
    /// Logarithm of a tyre's stiffness: its relative change (dimensionless).
    TyreStiffness(usize),
    /// Motion of the base: a velocity at constant accelerations, or an acceleration, through the resulting
    /// specific force.
    BaseMotion(BaseMotion),
}

impl Axis {
    /// The three axes.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Name: its letter.
    #[must_use]
    pub fn name(self) -> &'static str {
        ["x", "y", "z"][self as usize]
    }
}

impl InertiaElement {
    /// The elements in the order of a [`crate::machine::PayloadSpec`].
    pub const ALL: [Self; 6] = [Self::Xx, Self::Yy, Self::Zz, Self::Xy, Self::Xz, Self::Yz];

    /// Row and column in the tensor.
    #[must_use]
    pub fn place(self) -> (usize, usize) {
        [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)][self as usize]
    }

    /// Name: its two letters.
    #[must_use]
    pub fn name(self) -> &'static str {
        ["xx", "yy", "zz", "xy", "xz", "yz"][self as usize]
    }
}

impl Parameter {
    /// All signals and parameters of a machine, signals first: the order of every gradient.
    #[must_use]
    pub fn all(machine: &Machine) -> Vec<Self> {
        let mut all = Vec::new();
        for joint in 0..machine.joints.len() {
            all.extend([
                Self::JointPosition(joint),
                Self::JointVelocity(joint),
                Self::JointAcceleration(joint),
            ]);
        }
        let mut triple = |of: fn(Axis) -> Self| all.extend(Axis::ALL.map(of));
        triple(Self::SpecificForce);
        triple(Self::AngularVelocity);
        triple(Self::AngularAcceleration);
        if machine.tool.is_some() {
            triple(Self::ToolForce);
            triple(Self::ToolMoment);
        }
        all.extend((0..machine.contact.actuated_joints.len()).map(Self::ActuatorForce));
        let mut triple = |of: fn(Axis) -> Self| all.extend(Axis::ALL.map(of));
        triple(Self::ImuPosition);
        triple(Self::ImuRotation);
        if machine.arm_mounting.is_some() {
            triple(Self::ArmPosition);
        }
        for link in links_with_mass(machine) {
            all.push(Self::LinkMass(link));
            all.extend(Axis::ALL.map(|axis| Self::LinkCom(link, axis)));
            all.extend(InertiaElement::ALL.map(|element| Self::LinkInertia(link, element)));
        }
        all.extend((0..machine.payloads.len()).map(Self::PayloadMass));
        for wheel in 0..machine.wheels.len() {
            all.extend(Axis::ALL.map(|axis| Self::WheelPosition(wheel, axis)));
            all.push(Self::WheelRadius(wheel));
        }
        if matches!(machine.contact.split, Split::RollMomentDistribution { .. }) {
            all.push(Self::RollMomentDistribution);
        }
        if machine.contact.tyres_deflect {
            all.extend((0..machine.wheels.len()).map(Self::TyreStiffness));
        }
        all.extend(BaseMotion::ALL.map(Self::BaseMotion));
        all
    }

    /// Whether it is a signal, which varies with time, and not a parameter of the machine.
    #[must_use]
    pub fn is_signal(self) -> bool {
        matches!(
            self,
            Self::JointPosition(_)
                | Self::JointVelocity(_)
                | Self::JointAcceleration(_)
                | Self::SpecificForce(_)
                | Self::AngularVelocity(_)
                | Self::AngularAcceleration(_)
                | Self::ToolForce(_)
                | Self::ToolMoment(_)
                | Self::ActuatorForce(_)
                | Self::BaseMotion(_)
        )
    }

    /// Name, composed of the names of the machine's parts.
    #[must_use]
    pub fn name(self, machine: &Machine) -> String {
        let joint = |j: usize| &machine.joints[j].name;
        let link = |l: usize| &machine.links[l].name;
        let wheel = |w: usize| machine.wheels[w].name.to_lowercase();
        match self {
            Self::JointPosition(j) => format!("{}.position", joint(j)),
            Self::JointVelocity(j) => format!("{}.rate", joint(j)),
            Self::JointAcceleration(j) => format!("{}.acceleration", joint(j)),
            Self::SpecificForce(axis) => format!("imu.specific_force_{}", axis.name()),
            Self::AngularVelocity(axis) => format!("imu.angular_velocity_{}", axis.name()),
            Self::AngularAcceleration(axis) => format!("imu.angular_acceleration_{}", axis.name()),
            Self::ToolForce(axis) => format!("tool.force_{}", axis.name()),
            Self::ToolMoment(axis) => format!("tool.moment_{}", axis.name()),
            Self::ActuatorForce(j) => {
                let joint = &machine.contact.actuated_joints[j];
                format!("{}.force", joint.name(&machine.linkages))
            }
            Self::LinkMass(l) => format!("{}.mass", link(l)),
            Self::LinkCom(l, axis) => format!("{}.com_{}", link(l), axis.name()),
            Self::LinkInertia(l, element) => format!("{}.inertia_{}", link(l), element.name()),
            Self::PayloadMass(p) => format!("payload_{}.mass", p + 1),
            Self::WheelPosition(w, axis) => format!("wheel_{}.position_{}", wheel(w), axis.name()),
            Self::WheelRadius(w) => format!("wheel_{}.radius", wheel(w)),
            Self::ArmPosition(axis) => format!("arm.position_{}", axis.name()),
            Self::ImuPosition(axis) => format!("imu.position_{}", axis.name()),
            Self::ImuRotation(axis) => format!("imu.rotation_{}", axis.name()),
            Self::RollMomentDistribution => "contact.front_share".into(),
            Self::TyreStiffness(w) => format!("wheel_{}.stiffness_share", wheel(w)),
            Self::BaseMotion(travel) => format!("base.{}", travel.name()),
        }
    }
}

/// Indices of the links that have mass.
pub(crate) fn links_with_mass(machine: &Machine) -> impl Iterator<Item = usize> + '_ {
    (0..machine.links.len()).filter(|&link| machine.links[link].inertia.mass > 0.0)
}
