//! Reasons for a missing prediction.

named! {
    /// Reason for which nothing is predicted for a [`Law`](super::Law).
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
}

impl PredictionGap {
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
