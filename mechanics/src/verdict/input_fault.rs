//! Faults of the input.

use crate::machine::FaultKind;

named! {
    /// A fault of the input.
    #[derive(PartialOrd, Ord)]
    #[repr(u8)]
    pub enum InputFault {
        /// A sensor has never delivered a usable sample.
        NeverReceived,
        /// The last sample of a sensor is too old.
        Stale,
        /// Samples are missing.
        Lost,
        /// Samples were repeated, late or out of order.
        Disordered,
        /// A sensor's clock jumps or disagrees with the local clock.
        ClockJump,
        /// A required value is not finite.
        NotFinite,
        /// A value is outside the range of such a sensor.
        OutOfRange,
        /// A joint position is beyond the URDF limits.
        JointLimit,
        /// A value changes faster than physically possible.
        ImpossibleRate,
        /// Identical raw values repeat where noise is expected or motion is detected elsewhere.
        Frozen,
        /// An attitude quaternion does not have unit norm.
        NotUnit,
        /// Two signals that measure the same quantity disagree.
        Disagreement,
        /// A message is incomplete, malformed or of another version.
        Torn,
        /// A message comes from an unannounced source.
        WrongSource,
        /// A message or session belongs to another machine.
        WrongMachine,
        /// The producer of the samples has exited.
        ProducerGone,
        /// The verdict is too late after its sample.
        VerdictLate,
        /// A session was announced that the monitor refuses to follow.
        SessionRefused,
        /// The latched alarm is not on the disk: a power cut would lose it.
        AlarmUnsaved,
    }
}

impl InputFault {
    /// Whether the fault is in the values of a sensor, not in whether and when its samples arrive. A machine that overturns
    /// causes such faults by itself.
    #[must_use]
    pub fn is_about_values(self) -> bool {
        match self {
            Self::NotFinite
            | Self::OutOfRange
            | Self::JointLimit
            | Self::ImpossibleRate
            | Self::Frozen
            | Self::NotUnit
            | Self::Disagreement => true,
            Self::NeverReceived
            | Self::Stale
            | Self::Lost
            | Self::Disordered
            | Self::ClockJump
            | Self::Torn
            | Self::WrongSource
            | Self::WrongMachine
            | Self::ProducerGone
            | Self::VerdictLate
            | Self::SessionRefused
            | Self::AlarmUnsaved => false,
        }
    }
}

impl From<FaultKind> for InputFault {
    fn from(kind: FaultKind) -> Self {
        match kind {
            FaultKind::NotFinite => Self::NotFinite,
            FaultKind::OutOfRange | FaultKind::Saturated => Self::OutOfRange,
            FaultKind::JointLimit => Self::JointLimit,
            FaultKind::ImpossibleRate | FaultKind::Outlier => Self::ImpossibleRate,
            FaultKind::Frozen => Self::Frozen,
            FaultKind::NotUnit => Self::NotUnit,
            FaultKind::Disagreement | FaultKind::Contradiction => Self::Disagreement,
        }
    }
}

named_set! {
    /// A set of faults of the input.
    pub struct InputFaults(u32) of InputFault;
}

impl InputFaults {
    /// The set with these bits. Unknown bits are kept: a fault that only a newer program knows remains a fault.
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
