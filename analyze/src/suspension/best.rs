//! The best static posture within the stroke, at each sample.

use anyhow::Result;
use tipwatch_mechanics::{Motion, State};
use tipwatch_suspension::{MAX_ACTUATORS, Replay};

use crate::analysis::Analysis;

/// Positions tried within the stroke.
const POSITIONS: usize = 21;
/// Most rows used, evenly spread.
const MOST_ROWS: usize = 4000;

/// Smallest load spread over all static positions with equal rod strokes.
#[derive(Debug, Clone)]
pub struct Best {
    /// The rows used.
    pub rows: Vec<usize>,
    /// That spread, equation (35) with each pair once, by row used (N).
    pub spread: Vec<f64>,
    /// The rod stroke of that position (m).
    pub position: Vec<f64>,
}

impl Best {
    /// Mean of the spread (N).
    #[must_use]
    pub fn mean_spread(&self) -> f64 {
        self.spread.iter().sum::<f64>() / self.spread.len() as f64
    }
}

pub(super) fn postures(analysis: &Analysis) -> Result<Best> {
    let (machine, rows) = (&analysis.machine, &analysis.rows);
    let mut replay = Replay::new(machine)?;
    let stroke = machine.suspension().map_or([f64::NAN; 2], |s| s.stroke);
    let mut best = Best {
        rows: Vec::new(),
        spread: Vec::new(),
        position: Vec::new(),
    };
    let mut state = State::zero(machine);
    let every = rows.len().div_ceil(MOST_ROWS).max(1);
    for row in (0..rows.len()).step_by(every) {
        if !rows.reasons[row].leave_loads() {
            continue;
        }
        rows.states.get(row, &mut state);
        let mut least: Option<(f64, f64)> = None;
        for k in 0..POSITIONS {
            let share = k as f64 / (POSITIONS - 1) as f64;
            let position = stroke[0] + (stroke[1] - stroke[0]) * share;
            let rods = [Motion {
                position,
                ..Motion::zero()
            }; MAX_ACTUATORS];
            replay.moved(&state, &rods[..replay.actuators()]);
            let spread = replay.outcome().indicators.spread;
            if spread.is_finite() && least.is_none_or(|(known, _)| spread < known) {
                least = Some((spread, position));
            }
        }
        if let Some((spread, position)) = least {
            best.rows.push(row);
            best.spread.push(spread);
            best.position.push(position);
        }
    }
    Ok(best)
}
