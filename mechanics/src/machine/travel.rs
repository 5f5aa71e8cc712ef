//! Components of the base's motion that the loads are differentiated by.

/// Components of the base's motion that [`VelocityGradient`](crate::VelocityGradient) differentiates by.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Hash,
    strum::EnumCount,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[strum(serialize_all = "snake_case")]
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

impl BaseMotion {
    /// All components, in column order.
    pub const ALL: [Self; <Self as strum::EnumCount>::COUNT] =
        *<Self as strum::VariantArray>::VARIANTS
            .first_chunk()
            .expect("all variants");

    /// Name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }

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
