//! Commands to the valves between the control and the wire.

use tipwatch_suspension::Status;

use crate::wire::topics::WireCommand;

/// What the valves do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
#[repr(u32)]
pub enum Mode {
    /// Closed.
    #[default]
    Hold = 0,
    /// On their way from where they were to closed.
    Ramp = 1,
    /// They follow the stabiliser.
    Follow = 2,
}

impl Mode {
    /// The mode of this number; [`Mode::Hold`] of any other.
    #[must_use]
    pub fn from_number(number: u32) -> Self {
        [Self::Hold, Self::Ramp, Self::Follow]
            .into_iter()
            .find(|&mode| mode as u32 == number)
            .unwrap_or_default()
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Ramp => "ramp",
            Self::Follow => "follow",
        }
    }
}

/// Why the valves do not follow the stabiliser.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum HoldReason {
    /// No row has come, or none for too long.
    NoRow,
    /// The row's state is not known: a gap, an implausible signal, an estimate that settles.
    RowInvalid,
    /// There is no verdict of this session, or it has run out.
    NoVerdict,
    /// The monitor says unknown or fault, or a fault waits to be acknowledged.
    Verdict,
    /// The control's own checks have found a fault of the input.
    Input,
    /// The stabiliser has no solution.
    NoSolution,
    /// A rod has not moved though its valve was open: until somebody acknowledges.
    NotFollowing,
    /// Commands come too long after their samples.
    Late,
    /// All is well again, but only just.
    Starting,
}

impl HoldReason {
    /// All reasons, in their order.
    pub const ALL: [Self; 9] = [
        Self::NoRow,
        Self::RowInvalid,
        Self::NoVerdict,
        Self::Verdict,
        Self::Input,
        Self::NoSolution,
        Self::NotFollowing,
        Self::Late,
        Self::Starting,
    ];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NoRow => "no_row",
            Self::RowInvalid => "row_invalid",
            Self::NoVerdict => "no_verdict",
            Self::Verdict => "verdict",
            Self::Input => "input",
            Self::NoSolution => "no_solution",
            Self::NotFollowing => "not_following",
            Self::Late => "late",
            Self::Starting => "starting",
        }
    }
}

/// A set of reasons to hold; empty where the valves follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HoldReasons(u32);

impl HoldReasons {
    /// Adds a reason where it is the case.
    pub fn note(&mut self, reason: HoldReason, is_the_case: bool) {
        self.0 |= u32::from(is_the_case) << reason as u8;
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether it has `reason`.
    #[must_use]
    pub fn has(self, reason: HoldReason) -> bool {
        self.0 >> reason as u8 & 1 == 1
    }

    /// The reasons, in their order.
    pub fn iter(self) -> impl Iterator<Item = HoldReason> {
        HoldReason::ALL.into_iter().filter(move |&r| self.has(r))
    }

    /// The set as bits, for the wire.
    #[must_use]
    pub fn bits(self) -> u32 {
        self.0
    }

    /// The set of these bits. Bits of no known reason stay: they are reasons of a newer program.
    #[must_use]
    pub fn from_bits(bits: u32) -> Self {
        Self(bits)
    }
}

/// All states of the stabiliser, in the order of their numbers on the wire, which begin with 1.
const STATUSES: [Status; 7] = [
    Status::Optimal,
    Status::WorkLimit,
    Status::MarginLost,
    Status::StepTooShort,
    Status::OutsideLimits,
    Status::NoSolution,
    Status::PositionUnknown,
];

/// The number of a status on the wire; 0 where the stabiliser was not asked.
#[must_use]
pub fn status_number(status: Option<Status>) -> u32 {
    let place = STATUSES.iter().position(|&s| Some(s) == status);
    place.map_or(0, |place| place as u32 + 1)
}

impl WireCommand {
    /// What the valves do.
    #[must_use]
    pub fn mode(&self) -> Mode {
        Mode::from_number(self.mode)
    }

    /// Why they hold.
    #[must_use]
    pub fn reasons(&self) -> HoldReasons {
        HoldReasons::from_bits(self.reasons)
    }

    /// How the stabiliser found its last command; `None` where it was not asked.
    #[must_use]
    pub fn status(&self) -> Option<Status> {
        let place = self.status.checked_sub(1)?;
        STATUSES.get(place as usize).copied()
    }

    /// The name of its status.
    #[must_use]
    pub fn status_name(&self) -> &'static str {
        self.status().map_or("not_asked", Status::name)
    }

    /// A command to hold with closed valves.
    #[must_use]
    pub fn closed() -> Self {
        use crate::wire::topics::Wire;
        let mut wire = Self::blank();
        wire.cost = f64::NAN;
        for numbers in [
            &mut wire.measured,
            &mut wire.reference,
            &mut wire.velocity,
            &mut wire.target,
        ] {
            numbers.fill(f64::NAN);
        }
        wire.reasons = 1 << HoldReason::NoRow as u8;
        wire
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_on_the_wire_come_back() {
        for status in STATUSES {
            let wire = WireCommand {
                status: status_number(Some(status)),
                ..WireCommand::closed()
            };
            assert_eq!(wire.status(), Some(status));
        }
        assert_eq!(status_number(None), 0);
        assert_eq!(WireCommand::closed().status(), None);
        // damage never opens a valve
        assert_eq!(Mode::from_number(77), Mode::Hold);
        let mut reasons = HoldReasons::default();
        for (count, reason) in HoldReason::ALL.into_iter().enumerate() {
            reasons.note(reason, true);
            assert_eq!(reasons.iter().count(), count + 1);
        }
    }
}
