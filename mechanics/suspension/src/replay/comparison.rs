//! Recorded states with the suspension locked, moved as requested, and in the best posture at rest.

use tipwatch_mechanics::machine::{Machine, Suspension, SuspensionControl};

use super::best_posture::BestPostures;
use super::recorded::RecordedRows;
use super::track::Track;
use super::{controlled, prescribed};
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
    /// With the rods locked.
    pub fixed: Track,
    /// With the requested motion.
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
        let fixed = prescribed::locked(machine, rows)?;
        let moved = match motion {
            SuspensionMotion::Locked => fixed.clone(),
            SuspensionMotion::Recorded => prescribed::recorded(machine, rows)?,
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
