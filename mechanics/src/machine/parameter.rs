//! Signals and parameters with respect to which the loads can be differentiated.

use super::support_id::SupportId;
use super::travel::BaseMotion;

named! {
    /// An axis of a frame.
    #[derive(PartialOrd, Ord)]
    pub enum Axis {
        /// The first.
        X,
        /// The second.
        Y,
        /// The third.
        Z,
    }
}

named! {
    /// An element of an inertia tensor (not a product of inertia: I_xy = -sum m x y), in the order of a
    /// [`crate::machine::PayloadSpec`].
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
}

/// A signal, or a parameter of the machine. Indices refer to the machine's lists; supports keep theirs on every set.
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
    WheelPosition(SupportId, Axis),
    /// Unloaded radius of a wheel (m).
    WheelRadius(SupportId),
    /// Position of the arm on the link that carries it, in that link's axes (m).
    ArmPosition(Axis),
    /// Position of the IMU, in the axes of its body (m).
    ImuPosition(Axis),
    /// Small rotation of the IMU about an axis of its body (rad).
    ImuRotation(Axis),
    /// Roll moment distribution: D of assumption 8 of the first paper (dimensionless).
    RollMomentDistribution,
    /// Logarithm of a tyre's stiffness: its relative change (dimensionless).
    TyreStiffness(SupportId),
    /// Motion of the base: a velocity at constant accelerations, or an acceleration, through the resulting
    /// specific force.
    BaseMotion(BaseMotion),
}

impl InertiaElement {
    /// Row and column in the tensor.
    #[must_use]
    pub fn place(self) -> (usize, usize) {
        [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)][self as usize]
    }
}

impl Parameter {
    /// Whether the parameter is a signal, which varies with time, and not a constant of the machine.
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
}
