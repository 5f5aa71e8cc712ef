//! What of the base's travel the loads are differentiated by.

/// What of the base's travel [`VelocityGradient`](crate::VelocityGradient) differentiates by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Travel {
    /// v_x
    ForwardVelocity,
    /// v_y
    LeftVelocity,
    /// Yaw rate.
    YawRate,
    /// Rate of v_x.
    ForwardAcceleration,
    /// Rate of v_y.
    LeftAcceleration,
    /// Yaw acceleration.
    YawAcceleration,
}

impl Travel {
    /// All of them, in the order of their columns.
    pub const ALL: [Self; 6] = [
        Self::ForwardVelocity,
        Self::LeftVelocity,
        Self::YawRate,
        Self::ForwardAcceleration,
        Self::LeftAcceleration,
        Self::YawAcceleration,
    ];

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ForwardVelocity => "v_x",
            Self::LeftVelocity => "v_y",
            Self::YawRate => "yaw_rate",
            Self::ForwardAcceleration => "v_x_dot",
            Self::LeftAcceleration => "v_y_dot",
            Self::YawAcceleration => "yaw_rate_dot",
        }
    }

    /// Its unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::ForwardVelocity | Self::LeftVelocity => "m/s",
            Self::YawRate => "rad/s",
            Self::ForwardAcceleration | Self::LeftAcceleration => "m/s^2",
            Self::YawAcceleration => "rad/s^2",
        }
    }
}
