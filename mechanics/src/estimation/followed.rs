//! The quantities that filters follow, the sensors that feed them, and what their gaps mean.

use crate::state::{NumberKind, Reason, Sensor};

/// The quantity that a filter estimates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Followed {
    Joints(usize),
    SpecificForce,
    AngularVelocity,
    Up,
    Velocity,
    ToolWrench,
    Actuator(usize),
}

impl Followed {
    /// Whether samples of this sensor update its filter; `imu`: whether there is an IMU.
    pub(super) fn is_fed_by(self, sensor: Sensor, imu: bool) -> bool {
        match self {
            Self::Joints(stream) => sensor == Sensor::Joints(stream),
            Self::SpecificForce => sensor == Sensor::Imu,
            Self::AngularVelocity | Self::Up if imu => sensor == Sensor::Imu,
            Self::AngularVelocity | Self::Up | Self::Velocity => sensor == Sensor::Odometry,
            Self::ToolWrench => sensor == Sensor::ToolWrench,
            Self::Actuator(signal) => sensor == Sensor::Number(NumberKind::Actuator, signal),
        }
    }

    /// Returns the reason for which a row in a gap of this filter is invalid; `None` where rows are valid without the filter.
    pub(super) fn gap(self, imu: bool) -> Option<Reason> {
        match self {
            Self::Joints(_) => Some(Reason::JointsGap),
            Self::SpecificForce | Self::AngularVelocity if imu => Some(Reason::ImuGap),
            Self::SpecificForce => None,
            Self::AngularVelocity => Some(Reason::OdometryGap),
            Self::Up | Self::Velocity if imu => None,
            Self::Up | Self::Velocity => Some(Reason::OdometryGap),
            Self::ToolWrench => Some(Reason::ToolWrenchGap),
            Self::Actuator(_) => None,
        }
    }
}
