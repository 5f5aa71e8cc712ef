//! Which commissioning overrules a contradiction of the sensors that was found before.

use jiff::Timestamp;
use tipwatch_binding::Commissioning;
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::machine::{Proof, Proofs};

/// Why a contradiction stands.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Stands {
    /// There is no commissioning.
    #[error("the machine is not commissioned")]
    NotCommissioned,
    /// A file of version 1, or a drive without samples.
    #[error("the bound commissioning does not say when its drive was recorded")]
    DriveOfUnknownTime,
    /// The drive shows how the sensors were before.
    #[error("the drive of the bound commissioning begins before it, at {0}")]
    DriveBefore(Timestamp),
    /// The sensors' clock is wrong.
    #[error("the drive of the bound commissioning begins in the future, at {0}")]
    DriveAhead(Timestamp),
    /// It shows too little.
    #[error("the bound commissioning has not proven: {0}")]
    NotProven(String),
}

/// Whether a commissioning overrules a contradiction of this time: its drive must have begun later, and have proven every signal
/// that the loads hang on. Which of them was contradicted is not kept, and one wrong sensor can make another look wrong.
///
/// # Errors
/// The contradiction stands.
pub fn overrules(
    commissioning: Option<&Commissioning>,
    contradicted: Timestamp,
    needed: Proofs,
    machine: &Machine,
) -> Result<(), Stands> {
    let commissioning = commissioning.ok_or(Stands::NotCommissioned)?;
    let begins = recorded_from(commissioning).ok_or(Stands::DriveOfUnknownTime)?;
    if begins <= contradicted {
        return Err(Stands::DriveBefore(begins));
    }
    if begins > Timestamp::now() {
        return Err(Stands::DriveAhead(begins));
    }
    let mut open = needed.without(commissioning.proven(machine));
    // no drive shows the ground that comes
    open.remove(Proof::Ground);
    match open.is_empty() {
        true => Ok(()),
        false => Err(Stands::NotProven(open.names(machine).join(", "))),
    }
}

/// When its drive began, by the stamps of the sensors.
pub(super) fn recorded_from(commissioning: &Commissioning) -> Option<Timestamp> {
    let stamp_ns = commissioning.recorded_from_ns?;
    Timestamp::from_nanosecond(stamp_ns.into()).ok()
}
