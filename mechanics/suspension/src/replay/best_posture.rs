//! The best posture at rest within the stroke, at a selection of rows.

use tipwatch_mechanics::geometry::coordinate::Motion;
use tipwatch_mechanics::machine::{Machine, Suspension};
use tipwatch_mechanics::state::State;

use super::moved_state::Replay;
use super::recorded::RecordedRows;
use crate::condensed::MAX_ACTUATORS;
use crate::error::SuspensionError;

/// Positions tried within the stroke.
const POSITIONS: usize = 21;
/// Maximum number of rows used, evenly spread.
const MAX_ROWS: usize = 4000;

/// Smallest load spread over all postures at rest with equal rod strokes.
#[derive(Debug, Clone)]
pub struct BestPostures {
    /// The rows used.
    pub rows: Vec<usize>,
    /// Spread of the loads in that posture, (35) with each pair of wheels once, by row used (N).
    pub spread: Vec<f64>,
    /// The rod stroke of that posture (m).
    pub position: Vec<f64>,
}

impl BestPostures {
    /// Mean of the spread (N).
    #[must_use]
    pub fn mean_spread(&self) -> f64 {
        self.spread.iter().sum::<f64>() / self.spread.len() as f64
    }

    pub(super) fn of(
        machine: &Machine,
        rows: RecordedRows<'_>,
        suspension: &Suspension,
    ) -> Result<Self, SuspensionError> {
        let mut replay = Replay::new(machine)?;
        let [least, greatest] = suspension.stroke;
        let mut best = Self {
            rows: Vec::new(),
            spread: Vec::new(),
            position: Vec::new(),
        };
        let mut state = State::zero(machine);
        let every = rows.len().div_ceil(MAX_ROWS).max(1);
        for row in (0..rows.len()).step_by(every) {
            if !rows.has_loads(row) {
                continue;
            }
            rows.states.get(row, &mut state);
            let mut lowest: Option<(f64, f64)> = None;
            for k in 0..POSITIONS {
                let share = k as f64 / (POSITIONS - 1) as f64;
                let position = least + (greatest - least) * share;
                let rods = [Motion::at_rest(position); MAX_ACTUATORS];
                replay.moved(&state, &rods[..replay.actuators()]);
                let spread = replay.outcome().indicators.spread;
                if spread.is_finite() && lowest.is_none_or(|(known, _)| spread < known) {
                    lowest = Some((spread, position));
                }
            }
            if let Some((spread, position)) = lowest {
                best.rows.push(row);
                best.spread.push(spread);
                best.position.push(position);
            }
        }
        Ok(best)
    }
}
