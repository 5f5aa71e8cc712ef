//! The motions that are assumed.

/// A motion from now on.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Hash,
    strum::EnumCount,
    strum::EnumMessage,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[strum(serialize_all = "snake_case")]
#[repr(u8)]
pub enum Law {
    /// Joints and platform go on: velocities stay, accelerations die away, joints stop at their limits.
    GoOn = 0,
    /// The platform brakes now by the stated deceleration; the arm goes on.
    BrakeNow = 1,
    /// The joints of the arm stop now by the stated decelerations; the platform goes on.
    StopArm = 2,
}

impl Law {
    /// All of them, in order.
    pub const ALL: [Self; <Self as strum::EnumCount>::COUNT] =
        *<Self as strum::VariantArray>::VARIANTS
            .first_chunk()
            .expect("all variants");

    /// Name in tables and messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }
}
