//! Rods with prescribed motion: locked, or as recorded.

use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::State;

use super::moved_state::{Replay, Rods, at_rest};
use super::recorded::RecordedRows;
use super::track::Track;
use crate::error::SuspensionError;

/// The rods locked in the first usable row.
pub(super) fn locked(machine: &Machine, rows: RecordedRows<'_>) -> Result<Track, SuspensionError> {
    let mut locked: Option<Rods> = None;
    prescribed(machine, rows, |recorded| {
        *locked.get_or_insert_with(|| at_rest(&recorded))
    })
}

/// The rods as recorded.
pub(super) fn recorded(
    machine: &Machine,
    rows: RecordedRows<'_>,
) -> Result<Track, SuspensionError> {
    prescribed(machine, rows, |recorded| recorded)
}

fn prescribed(
    machine: &Machine,
    rows: RecordedRows<'_>,
    mut motion: impl FnMut(Rods) -> Rods,
) -> Result<Track, SuspensionError> {
    let mut replay = Replay::new(machine)?;
    let actuators = replay.actuators();
    let mut track = Track::new(machine, actuators);
    let mut state = State::zero(machine);
    for row in 0..rows.len() {
        rows.states.get(row, &mut state);
        let recorded = replay.rods(&state);
        if !rows.is_usable(row, &recorded) {
            track.push_unknown();
            continue;
        }
        let rods = motion(recorded);
        replay.moved(&state, &rods[..actuators]);
        track.push(&replay, &rods, None, None);
    }
    Ok(track)
}
