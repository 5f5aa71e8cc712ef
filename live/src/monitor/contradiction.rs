//! Rules by which a commissioning overrules an earlier contradiction of the sensors.

use jiff::Timestamp;
use tipwatch_binding::Commissioning;
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::estimation::plausibility::SignalDoubt;
use tipwatch_mechanics::machine::{Proof, Proofs};

use super::session_monitor::of_shared_places;
use crate::system::clock::knows_the_day;

/// Reason for which a contradiction stands in spite of a commissioning.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Stands {
    /// There is no commissioning.
    #[error("the machine is not commissioned")]
    NotCommissioned,
    /// A file of version 1, or a drive without samples.
    #[error(
        "the bound commissioning does not say when its drive was recorded, or by a clock that does not know the time of day: make it \
         on the machine (tipwatch-live check-machine)"
    )]
    DriveOfUnknownTime,
    /// The drive shows how the sensors were before.
    #[error("the drive of the bound commissioning begins before it, at {0}")]
    DriveBefore(Timestamp),
    /// The sensors' clock is wrong.
    #[error("the drive of the bound commissioning begins in the future, at {0}")]
    DriveAhead(Timestamp),
    /// The commissioning shows too little.
    #[error("the bound commissioning has not proven: {0}")]
    NotProven(String),
    /// A joint that has jumped: its sign and scale are what they were.
    #[error("no commissioning shows where the zero of a joint is")]
    NoZeroChecked,
}

/// Checks that a commissioning overrules a contradiction of this time: its drive must have begun later, and have proven every
/// signal that the loads hang on. Which of them was contradicted is not kept, and one wrong sensor can make another look wrong.
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
    let joints = machine.joints().len();
    let shared = of_shared_places(joints);
    let open = needed.without(commissioning.proven(machine).proofs());
    let mut open = open.with(needed.shared_with(shared));
    // no drive shows the ground that comes
    open.remove(Proof::Ground);
    match open.is_empty() {
        true => Ok(()),
        false => Err(Stands::NotProven(open.names(machine).join(", "))),
    }
}

/// Checks that a commissioning overrules the doubt of a signal that failed visibly at this time. A commissioning shows the
/// mounting and scale of the specific force, of a housing that turned together with that of the gyro, and that a joint whose encoder
/// had stopped, or did not show what was asked, is measured again. It does not show the zero of a joint, which is wrong after a jump.
///
/// # Errors
/// The doubt stands.
pub(super) fn overrules_doubt(
    commissioning: Option<&Commissioning>,
    since: Timestamp,
    doubt: &SignalDoubt,
    machine: &Machine,
) -> Result<(), Stands> {
    match doubt.signal {
        Proof::Joint(_) if !doubt.is_frozen() && !doubt.disobeys() => Err(Stands::NoZeroChecked),
        signal => {
            let signals: Proofs = [signal].into_iter().collect();
            let signals = signals.with(doubt.disputed());
            overrules(commissioning, since, signals, machine)
        }
    }
}

/// Returns the time at which the drive of a commissioning began; `None` where the commissioning does not state it, or states it
/// by a clock that does not know the time of day.
pub(super) fn recorded_from(commissioning: &Commissioning) -> Option<Timestamp> {
    let stamp_ns = commissioning.recorded_from_ns?;
    let begins = Timestamp::from_nanosecond(stamp_ns.into()).ok()?;
    knows_the_day(stamp_ns).then_some(begins)
}
