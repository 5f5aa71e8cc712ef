//! Why there is no prediction.

/// Why nothing is predicted for a [`Law`](super::Law).
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
pub enum PredictionGap {
    /// The present row has no meaningful loads, or its level is unknown or a fault.
    RowInvalid = 1,
    /// The velocity of the platform is unknown.
    VelocityUnknown = 2,
    /// The machine file names no arm with joints.
    NoArm = 3,
    /// The motion leads out of the range in which a linkage closes, before a wheel lifts.
    LinkageOpen = 4,
    /// The loads ahead cannot be computed, before a wheel lifts.
    NotFinite = 5,
    /// The supports of the machine come and go.
    SupportsVary = 6,
}

impl PredictionGap {
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

    /// The gap with this number; `None` for zero. An unknown number is [`PredictionGap::RowInvalid`], so that corruption
    /// never reads as a prediction.
    #[must_use]
    pub fn from_number(number: u32) -> Option<Self> {
        let is_it = |gap: &Self| *gap as u32 == number;
        (number != 0).then(|| {
            Self::ALL
                .into_iter()
                .find(is_it)
                .unwrap_or(Self::RowInvalid)
        })
    }
}
