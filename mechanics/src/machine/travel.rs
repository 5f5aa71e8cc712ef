//! Components of the base's motion that the loads are differentiated by.

named! {
    /// Components of the base's motion that [`VelocityGradient`](crate::VelocityGradient) differentiates by.
    pub enum BaseMotion {
        /// v_x
        #[strum(serialize = "v_x")]
        ForwardVelocity,
        /// v_y
        #[strum(serialize = "v_y")]
        LeftVelocity,
        /// Yaw rate.
        YawRate,
        /// Time derivative of v_x.
        #[strum(serialize = "v_x_dot")]
        ForwardAcceleration,
        /// Time derivative of v_y.
        #[strum(serialize = "v_y_dot")]
        LeftAcceleration,
        /// Yaw acceleration.
        #[strum(serialize = "yaw_rate_dot")]
        YawAcceleration,
    }
}

impl BaseMotion {
    /// Unit.
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
