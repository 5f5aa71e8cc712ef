//! The levels of a verdict.

named! {
    /// Stability level. Its order is that of urgency: unknown, safe, assumed, notice, warning, danger, fault; [`Level::Unknown`]
    /// is outside that order and never safe.
    #[derive(Default)]
    #[repr(u8)]
    pub enum Level {
        /// No statement is possible, or the signals contradict each other: not even that the machine is safe.
        #[default]
        Unknown = 0,
        /// All inputs are complete, valid and proven, and every wheel carries enough load.
        Safe = 1,
        /// The worst wheel has lost much of its load.
        Notice = 2,
        /// The worst wheel has lost most of its load, or the input is late.
        Warning = 3,
        /// A wheel is about to lift, has lifted, or the machine is tipping.
        Danger = 4,
        /// The input or the computation has failed: the machine is not being monitored.
        Fault = 5,
        /// No danger is seen, but the sensors are not proven: every wheel carries enough load if they are right.
        // The number is the last so that a program of before takes it for an unknown one, and not for safe.
        Assumed = 6,
    }
}

impl Ord for Level {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.urgency().cmp(&other.urgency())
    }
}

impl PartialOrd for Level {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Level {
    /// Place in the order of urgency.
    fn urgency(self) -> u8 {
        match self {
            Self::Unknown => 0,
            Self::Safe => 1,
            Self::Assumed => 2,
            Self::Notice => 3,
            Self::Warning => 4,
            Self::Danger => 5,
            Self::Fault => 6,
        }
    }

    /// Its number in `diagnostic_msgs/DiagnosticStatus`: OK, WARN, ERROR and STALE.
    #[must_use]
    pub fn diagnostic(self) -> u8 {
        match self {
            Self::Safe => 0,
            Self::Assumed | Self::Notice | Self::Warning => 1,
            Self::Danger | Self::Fault => 2,
            Self::Unknown => 3,
        }
    }

    /// Whether the level says that every wheel carries enough load, be the sensors proven or not.
    #[must_use]
    pub fn sees_no_danger(self) -> bool {
        matches!(self, Self::Safe | Self::Assumed)
    }

    /// Whether a forecast of lift-off is announced at this level: a wheel has lost load, and the inputs hold.
    #[must_use]
    pub fn announces_lift_off(self) -> bool {
        matches!(self, Self::Notice | Self::Warning | Self::Danger)
    }

    /// The level with this number; [`Level::Fault`] for an unknown number, so that corruption never reads as safe.
    #[must_use]
    pub fn from_number(number: u32) -> Self {
        let is_it = |level: &Self| *level as u32 == number;
        Self::ALL.into_iter().find(is_it).unwrap_or(Self::Fault)
    }
}
