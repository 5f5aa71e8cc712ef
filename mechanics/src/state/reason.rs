//! Why a row is not valid.

/// A reason for which a row is not valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Reason {
    /// No joint states near enough in time.
    JointsGap,
    /// No IMU sample near enough in time.
    ImuGap,
    /// No odometry near enough in time, where it stands in for another sensor.
    OdometryGap,
    /// No tool wrench near enough in time.
    ToolWrenchGap,
    /// The joint states are implausible.
    JointsFault,
    /// What the IMU says is implausible.
    ImuFault,
    /// The odometry is implausible, where it stands in for another sensor.
    OdometryFault,
    /// The tool wrench is implausible.
    ToolWrenchFault,
    /// The estimator has only just started, or started again after a gap.
    Settling,
    /// A linkage cannot close at the measured position.
    LinkageOpen,
    /// The ground does not push: the machine is in the air, or an input is wrong.
    NoGroundContact,
    /// The machine is tipping about an edge.
    Tipping,
    /// An input or result is no finite number.
    NotFinite,
}

impl Reason {
    /// All reasons, in their order.
    pub const ALL: [Self; 13] = [
        Self::JointsGap,
        Self::ImuGap,
        Self::OdometryGap,
        Self::ToolWrenchGap,
        Self::JointsFault,
        Self::ImuFault,
        Self::OdometryFault,
        Self::ToolWrenchFault,
        Self::Settling,
        Self::LinkageOpen,
        Self::NoGroundContact,
        Self::Tipping,
        Self::NotFinite,
    ];

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::JointsGap => "joints_gap",
            Self::ImuGap => "imu_gap",
            Self::OdometryGap => "odometry_gap",
            Self::ToolWrenchGap => "tool_wrench_gap",
            Self::JointsFault => "joints_fault",
            Self::ImuFault => "imu_fault",
            Self::OdometryFault => "odometry_fault",
            Self::ToolWrenchFault => "tool_wrench_fault",
            Self::Settling => "settling",
            Self::LinkageOpen => "linkage_open",
            Self::NoGroundContact => "no_ground_contact",
            Self::Tipping => "tipping",
            Self::NotFinite => "not_finite",
        }
    }
}

/// A set of reasons; empty for a valid row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Reasons(u16);

impl Reasons {
    /// The set without reasons.
    pub const NONE: Self = Self(0);

    /// Adds a reason.
    pub fn add(&mut self, reason: Reason) {
        self.0 |= 1 << reason as u8;
    }

    /// Adds all reasons of another set.
    pub fn add_all(&mut self, others: Self) {
        self.0 |= others.0;
    }

    /// Whether the set has `reason`.
    #[must_use]
    pub fn has(self, reason: Reason) -> bool {
        self.0 >> reason as u8 & 1 == 1
    }

    /// Whether the row is valid.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether the loads mean something: the row is valid, or the machine is tipping, when accuracy is
    /// no longer claimed.
    #[must_use]
    pub fn leave_loads(self) -> bool {
        self.iter().all(|reason| reason == Reason::Tipping)
    }

    /// Whether a gap or an implausible signal leaves the state unknown.
    #[must_use]
    pub fn leave_state_unknown(self) -> bool {
        self.have_gap() || self.have_implausible_signal()
    }

    /// Whether a signal is missing.
    #[must_use]
    pub fn have_gap(self) -> bool {
        self.has(Reason::JointsGap)
            || self.has(Reason::ImuGap)
            || self.has(Reason::OdometryGap)
            || self.has(Reason::ToolWrenchGap)
    }

    /// Whether a signal that the row rests on is implausible.
    #[must_use]
    pub fn have_implausible_signal(self) -> bool {
        self.has(Reason::JointsFault)
            || self.has(Reason::ImuFault)
            || self.has(Reason::OdometryFault)
            || self.has(Reason::ToolWrenchFault)
    }

    /// The reasons, in their order.
    pub fn iter(self) -> impl Iterator<Item = Reason> {
        Reason::ALL.into_iter().filter(move |&r| self.has(r))
    }

    /// The set as bits, for a wire or a file; see [`Self::from_bits`].
    #[must_use]
    pub fn bits(self) -> u16 {
        self.0
    }

    /// The set of these bits; bits of no reason are dropped.
    #[must_use]
    pub fn from_bits(bits: u16) -> Self {
        Self(bits & ((1 << Reason::ALL.len()) - 1))
    }
}
