//! Valve commands: modes, reasons to hold, and their numbers on the wire.

use tipwatch_suspension::Status;

use crate::wire::topics::WireCommand;

tipwatch_mechanics::named! {
    /// Mode of the valves.
    #[derive(PartialOrd, Ord, Default, strum::FromRepr)]
    #[repr(u32)]
    pub enum Mode {
        /// Held closed.
        #[default]
        Hold = 0,
        /// Closing.
        Ramp = 1,
        /// Following the optimiser.
        Follow = 2,
    }
}

impl Mode {
    /// The mode of this number; [`Mode::Hold`] for an unknown one.
    #[must_use]
    pub fn from_number(number: u32) -> Self {
        Self::from_repr(number).unwrap_or_default()
    }
}

tipwatch_mechanics::named! {
    /// Why the valves do not follow the optimiser.
    #[repr(u8)]
    pub enum HoldReason {
        /// No row has been received, or none for too long.
        NoRow,
        /// The state of the row is unknown: a gap, an implausible signal, an estimate that has not settled.
        RowInvalid,
        /// There is no verdict of this session, or it has expired.
        NoVerdict,
        /// The verdict is unknown or fault, or a fault has not been acknowledged.
        Verdict,
        /// The control's own checks have found a fault in the input.
        Input,
        /// The optimiser has no solution.
        NoSolution,
        /// A rod has not moved although its valve was open. Needs an acknowledgement.
        NotFollowing,
        /// Commands are published too long after their samples.
        Late,
        /// Everything is good, but not for long enough.
        Starting,
        /// A rod has moved against its valve: valves or sensors are exchanged or reversed. Needs an acknowledgement.
        WrongWay,
        /// A measured rod is outside the stroke of the machine file.
        OutsideStroke,
    }
}

tipwatch_mechanics::named_set! {
    /// A set of reasons to hold; empty if the valves follow.
    pub struct HoldReasons(u32) of HoldReason;
}

impl HoldReasons {
    /// Adds a reason if it applies.
    pub fn note(&mut self, reason: HoldReason, applies: bool) {
        self.0 |= u32::from(applies) << reason as u8;
    }

    /// The set with these bits. Unknown bits are kept: a newer program has more reasons.
    #[must_use]
    pub fn from_bits(bits: u32) -> Self {
        Self(bits)
    }
}

/// The number of a status on the wire; 0 if the optimiser was not asked.
#[must_use]
pub fn status_number(status: Option<Status>) -> u32 {
    let place = Status::ALL.iter().position(|&s| Some(s) == status);
    place.map_or(0, |place| place as u32 + 1)
}

impl WireCommand {
    /// Mode of the valves.
    #[must_use]
    pub fn mode(&self) -> Mode {
        Mode::from_number(self.mode)
    }

    /// Returns the reasons for which the valves do not follow.
    #[must_use]
    pub fn reasons(&self) -> HoldReasons {
        HoldReasons::from_bits(self.reasons)
    }

    /// Status of the optimiser's last solution; `None` if it was not asked.
    #[must_use]
    pub fn status(&self) -> Option<Status> {
        let place = self.status.checked_sub(1)?;
        Status::ALL.get(place as usize).copied()
    }

    /// Name of the status.
    #[must_use]
    pub fn status_name(&self) -> &'static str {
        self.status().map_or("not_asked", Status::name)
    }

    /// A command that holds the valves closed.
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
    fn statuses_survive_the_wire() {
        for status in Status::ALL {
            let wire = WireCommand {
                status: status_number(Some(status)),
                ..WireCommand::closed()
            };
            assert_eq!(wire.status(), Some(status));
        }
        assert_eq!(status_number(None), 0);
        assert_eq!(WireCommand::closed().status(), None);
        // a damaged number never opens a valve
        assert_eq!(Mode::from_number(77), Mode::Hold);
        let mut reasons = HoldReasons::default();
        for (count, reason) in HoldReason::ALL.into_iter().enumerate() {
            reasons.note(reason, true);
            assert_eq!(reasons.iter().count(), count + 1);
        }
    }
}
