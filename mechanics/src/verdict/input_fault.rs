//! What can be wrong with an input, as whoever takes the samples finds it.

use crate::machine::FaultKind;

/// Something wrong with the input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum InputFault {
    /// A sensor has never given a sample that could be used.
    NeverReceived,
    /// The last sample of a sensor is too old.
    Stale,
    /// Samples are missing.
    Lost,
    /// Samples came again, late or in the wrong order.
    Disordered,
    /// A sensor's clock jumps, or disagrees with this computer's.
    ClockJump,
    /// A needed value is no finite number.
    NotFinite,
    /// A value that no such sensor can truly have.
    OutOfRange,
    /// A joint position beyond the limits of the URDF.
    JointLimit,
    /// A value changes faster than any machine can.
    ImpossibleRate,
    /// The same raw values again and again, where noise is expected or motion is seen elsewhere.
    Frozen,
    /// An attitude that is no unit quaternion.
    NotUnit,
    /// Two signals that tell of one thing do not agree.
    Disagreement,
    /// A message is torn, malformed, or of another version.
    Torn,
    /// A message is of a source that was not announced.
    WrongSource,
    /// A message or session is of another machine.
    WrongMachine,
    /// Who writes the samples has gone.
    ProducerGone,
    /// The verdict comes too long after its sample.
    VerdictLate,
}

impl InputFault {
    /// All faults, in their order.
    pub const ALL: [Self; 17] = [
        Self::NeverReceived,
        Self::Stale,
        Self::Lost,
        Self::Disordered,
        Self::ClockJump,
        Self::NotFinite,
        Self::OutOfRange,
        Self::JointLimit,
        Self::ImpossibleRate,
        Self::Frozen,
        Self::NotUnit,
        Self::Disagreement,
        Self::Torn,
        Self::WrongSource,
        Self::WrongMachine,
        Self::ProducerGone,
        Self::VerdictLate,
    ];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NeverReceived => "never_received",
            Self::Stale => "stale",
            Self::Lost => "lost",
            Self::Disordered => "disordered",
            Self::ClockJump => "clock_jump",
            Self::NotFinite => "not_finite",
            Self::OutOfRange => "out_of_range",
            Self::JointLimit => "joint_limit",
            Self::ImpossibleRate => "impossible_rate",
            Self::Frozen => "frozen",
            Self::NotUnit => "not_unit",
            Self::Disagreement => "disagreement",
            Self::Torn => "torn",
            Self::WrongSource => "wrong_source",
            Self::WrongMachine => "wrong_machine",
            Self::ProducerGone => "producer_gone",
            Self::VerdictLate => "verdict_late",
        }
    }
}

impl From<FaultKind> for InputFault {
    fn from(kind: FaultKind) -> Self {
        match kind {
            FaultKind::NotFinite => Self::NotFinite,
            FaultKind::OutOfRange => Self::OutOfRange,
            FaultKind::JointLimit => Self::JointLimit,
            FaultKind::ImpossibleRate => Self::ImpossibleRate,
            FaultKind::Frozen => Self::Frozen,
            FaultKind::NotUnit => Self::NotUnit,
            FaultKind::Disagreement => Self::Disagreement,
        }
    }
}

/// A set of faults of the input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct InputFaults(u32);

impl InputFaults {
    /// The empty set.
    pub const NONE: Self = Self(0);

    /// Adds a fault.
    pub fn add(&mut self, fault: InputFault) {
        self.0 |= 1 << fault as u8;
    }

    /// Adds all of another set.
    pub fn add_all(&mut self, others: Self) {
        self.0 |= others.0;
    }

    /// Whether the set has `fault`.
    #[must_use]
    pub fn has(self, fault: InputFault) -> bool {
        self.0 >> fault as u8 & 1 == 1
    }

    /// Whether nothing is wrong.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The faults, in their order.
    pub fn iter(self) -> impl Iterator<Item = InputFault> {
        InputFault::ALL.into_iter().filter(move |&f| self.has(f))
    }

    /// The set as bits, for a wire or a file; see [`Self::from_bits`].
    #[must_use]
    pub fn bits(self) -> u32 {
        self.0
    }

    /// The set of these bits. Bits of no known fault stay: a fault that a newer program knows is one
    /// here too.
    #[must_use]
    pub fn from_bits(bits: u32) -> Self {
        Self(bits)
    }
}

impl From<InputFault> for InputFaults {
    fn from(fault: InputFault) -> Self {
        let mut set = Self::NONE;
        set.add(fault);
        set
    }
}
