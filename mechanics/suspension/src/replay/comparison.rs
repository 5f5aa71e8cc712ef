//! Recorded states with the suspension locked, moved as requested, and in the best posture at rest.

use tipwatch_mechanics::machine::{Machine, Suspension, SuspensionControl};
use tipwatch_mechanics::state::State;

use super::best_posture::BestPostures;
use super::controlled;
use super::moved_state::{Replay, Rods, at_rest};
use super::recorded::RecordedRows;
use super::track::Track;
use crate::error::SuspensionError;

/// Motion of the suspension in a replay.
#[derive(Debug, Clone, PartialEq)]
pub enum SuspensionMotion {
    /// Rods locked in the first usable row.
    Locked,
    /// As recorded.
    Recorded,
    /// On cylinders whose valves stay closed: locked, but for what the oil yields.
    Held,
    /// By this control, through valves and cylinders.
    Controlled(SuspensionControl),
}

/// A motion of the suspension compared with the suspension locked, and with the best possible posture.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// The suspension.
    pub suspension: Suspension,
    /// Motion with the rods locked.
    pub fixed: Track,
    /// The requested motion.
    pub moved: Track,
    /// The best posture at rest, at a selection of rows.
    pub best: BestPostures,
}

impl Comparison {
    /// Replays recorded rows.
    ///
    /// # Errors
    /// The suspension of the machine cannot move as requested, or no row has a known posture.
    pub fn of(
        machine: &Machine,
        rows: RecordedRows<'_>,
        motion: &SuspensionMotion,
    ) -> Result<Self, SuspensionError> {
        let suspension = machine
            .suspension()
            .cloned()
            .ok_or(SuspensionError::NoSuspension)?;
        let fixed = locked(machine, rows)?;
        let moved = match motion {
            SuspensionMotion::Locked => fixed.clone(),
            SuspensionMotion::Recorded => recorded(machine, rows)?,
            SuspensionMotion::Held => controlled::held(machine, rows, &suspension)?,
            SuspensionMotion::Controlled(control) => {
                controlled::controlled(machine, rows, &suspension, control)?
            }
        };
        let best = BestPostures::of(machine, rows, &suspension)?;
        Ok(Self {
            suspension,
            fixed,
            moved,
            best,
        })
    }

    /// Achieved reduction of the mean load spread, as a share of the reduction by the best posture; `None` if that
    /// reduces nothing.
    #[must_use]
    pub fn gain_share(&self) -> Option<f64> {
        let mean = |values: &[f64]| {
            let known = || self.best.rows.iter().map(|&row| values[row]);
            let sum: f64 = known().filter(|v| v.is_finite()).sum();
            sum / known().filter(|v| v.is_finite()).count() as f64
        };
        let fixed = mean(&self.fixed.spread);
        let best = self.best.mean_spread();
        let share = (fixed - mean(&self.moved.spread)) / (fixed - best);
        (fixed > best && share.is_finite()).then_some(share)
    }
}

/// The rods locked in the first usable row.
fn locked(machine: &Machine, rows: RecordedRows<'_>) -> Result<Track, SuspensionError> {
    let mut locked: Option<Rods> = None;
    prescribed(machine, rows, |recorded| {
        *locked.get_or_insert_with(|| at_rest(&recorded))
    })
}

/// The rods as recorded.
fn recorded(machine: &Machine, rows: RecordedRows<'_>) -> Result<Track, SuspensionError> {
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
