//! The kinds of implausible signals that a machine file sets policies for.

/// What is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FaultKind {
    /// A NaN or an infinite value.
    NotFinite,
    /// A value that no such sensor can truly have.
    OutOfRange,
    /// A joint position beyond the limits of the URDF.
    JointLimit,
    /// A rate, or a change from one sample to the next, that no machine has.
    ImpossibleRate,
    /// The same raw values again and again, where noise is expected or motion is seen elsewhere.
    Frozen,
    /// A quaternion that is not of length one.
    NotUnit,
    /// Two measurements of the same do not agree: a joint's rate and its position, an IMU's attitude and the
    /// gravity that it feels.
    Disagreement,
}

impl FaultKind {
    /// All kinds, in their order.
    pub const ALL: [Self; 7] = [
        Self::NotFinite,
        Self::OutOfRange,
        Self::JointLimit,
        Self::ImpossibleRate,
        Self::Frozen,
        Self::NotUnit,
        Self::Disagreement,
    ];

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NotFinite => "not_finite",
            Self::OutOfRange => "out_of_range",
            Self::JointLimit => "joint_limit",
            Self::ImpossibleRate => "impossible_rate",
            Self::Frozen => "frozen",
            Self::NotUnit => "not_unit",
            Self::Disagreement => "disagreement",
        }
    }
}
