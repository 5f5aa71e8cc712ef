//! Reasons for which a row is invalid or doubted.

named! {
    /// Reason for which a row is invalid; [`Reason::Contradiction`] leaves a row valid, and casts doubt on it.
    #[derive(PartialOrd, Ord)]
    #[repr(u8)]
    pub enum Reason {
        /// No joint states close enough in time.
        JointsGap,
        /// No IMU sample close enough in time.
        ImuGap,
        /// No odometry close enough in time, where it replaces another sensor.
        OdometryGap,
        /// No tool wrench, or no mass of a payload that a signal states or a cylinder weighs, close enough in time.
        ToolWrenchGap,
        /// Implausible joint states.
        JointsFault,
        /// Implausible IMU samples.
        ImuFault,
        /// Implausible odometry, where it replaces another sensor.
        OdometryFault,
        /// Implausible tool wrench.
        ToolWrenchFault,
        /// The estimator is warming up after its start or a gap.
        Settling,
        /// A linkage cannot close at the measured position.
        LinkageOpen,
        /// The computed ground force does not push up: the machine is airborne, or an input is wrong.
        NoGroundContact,
        /// The machine is tipping about an edge.
        Tipping,
        /// An input or result is not finite.
        NotFinite,
        /// An input of the whole log is grossly wrong, such as one in another unit: nothing can be concluded.
        GrossInput,
        /// Signals contradict each other, and which one is wrong is unknown: the row is valid, and doubted.
        Contradiction,
        /// Which supports are on the ground is unknown or is changing, or one that is reported as set measures no load.
        SupportsUnknown,
    }
}

/// Of each signal, the gap and the fault.
const OF_SIGNALS: [[Reason; 2]; 4] = [
    [Reason::JointsGap, Reason::JointsFault],
    [Reason::ImuGap, Reason::ImuFault],
    [Reason::OdometryGap, Reason::OdometryFault],
    [Reason::ToolWrenchGap, Reason::ToolWrenchFault],
];

named_set! {
    /// A set of reasons.
    pub struct Reasons(u16) of Reason;
}

impl Reasons {
    /// The set of one reason.
    pub(crate) const fn of(reason: Reason) -> Self {
        Self(1 << reason as u8)
    }

    /// Returns the set without a reason.
    #[must_use]
    pub fn without(self, reason: Reason) -> Self {
        Self(self.0 & !Self::of(reason).0)
    }

    /// Whether the row is valid: there is no reason, or a doubt alone.
    #[must_use]
    pub fn leave_valid(self) -> bool {
        self.0 & !Self::of(Reason::Contradiction).0 == 0
    }

    /// Whether signals that the row depends on contradict each other.
    #[must_use]
    pub fn have_doubt(self) -> bool {
        self.has(Reason::Contradiction)
    }

    /// Whether loads are meaningful: the row is valid, or the machine is tipping, where their accuracy is no
    /// longer guaranteed.
    #[must_use]
    pub fn leave_loads(self) -> bool {
        let harmless = Self::of(Reason::Tipping).0 | Self::of(Reason::Contradiction).0;
        self.0 & !harmless == 0
    }

    /// Whether loads are expected: the row is valid, or the estimator is warming up.
    pub(crate) fn leave_inputs_known(self) -> bool {
        Self(self.0 & !Self::of(Reason::Settling).0).leave_valid()
    }

    /// Whether a gap or an implausible signal makes the state unknown.
    #[must_use]
    pub fn leave_state_unknown(self) -> bool {
        self.have_gap() || self.have_signal_fault()
    }

    /// Whether a signal is missing.
    #[must_use]
    pub fn have_gap(self) -> bool {
        OF_SIGNALS.iter().any(|[gap, _]| self.has(*gap))
    }

    /// Whether a signal that the row depends on is implausible by itself.
    #[must_use]
    pub fn have_signal_fault(self) -> bool {
        OF_SIGNALS.iter().any(|[_, fault]| self.has(*fault))
    }

    /// Returns the faults of signals whose implausible samples are left out: those in a gap of this row, and those of the rows `before`
    /// while the gap goes on.
    pub(crate) fn left_out(self, before: Self) -> Self {
        let mut faults = Self::NONE;
        for [gap, fault] in OF_SIGNALS {
            if self.has(gap) && (self.has(fault) || before.has(fault)) {
                faults.add(fault);
            }
        }
        faults
    }

    /// Whether a signal is missing, and not because its implausible samples are `left_out`.
    pub(crate) fn have_gap_besides(self, left_out: Self) -> bool {
        (OF_SIGNALS.iter()).any(|[gap, fault]| self.has(*gap) && !left_out.has(*fault))
    }

    /// The set with these bits; unknown bits are ignored.
    #[must_use]
    pub fn from_bits(bits: u16) -> Self {
        Self(bits & (u16::MAX >> (16 - Reason::ALL.len())))
    }
}
