//! The levels of a verdict.

/// How a machine stands, by rising urgency; [`Level::Unknown`] stands beside that order and is never
/// safe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[repr(u8)]
pub enum Level {
    /// Nothing can be said, not even that it is safe.
    #[default]
    Unknown = 0,
    /// All inputs are complete and in order, and every wheel carries enough.
    Safe = 1,
    /// The worst wheel has lost much of its load.
    Notice = 2,
    /// The worst wheel has lost most of its load, or the input is late.
    Warning = 3,
    /// A wheel is about to lift, has lifted, or the machine is tipping.
    Danger = 4,
    /// The input or the computation has failed: whatever the machine does, nobody watches it.
    Fault = 5,
}

impl Level {
    /// All levels, in their order.
    pub const ALL: [Self; 6] = [
        Self::Unknown,
        Self::Safe,
        Self::Notice,
        Self::Warning,
        Self::Danger,
        Self::Fault,
    ];

    /// Its name in tables and on the wire.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Safe => "safe",
            Self::Notice => "notice",
            Self::Warning => "warning",
            Self::Danger => "danger",
            Self::Fault => "fault",
        }
    }

    /// The level of this number; [`Level::Fault`] of any other, so that no damage reads as safe.
    #[must_use]
    pub fn from_number(number: u32) -> Self {
        let is_it = |level: &Self| *level as u32 == number;
        Self::ALL.into_iter().find(is_it).unwrap_or(Self::Fault)
    }
}
