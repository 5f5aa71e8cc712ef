//! The study of parametric uncertainty over a whole log.

use rayon::prelude::*;
use tipwatch_mechanics::StateColumns;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::monte_carlo::{Band, Study, bands};

/// Rows of one piece of parallel work.
const BLOCK_ROWS: usize = 128;
/// The paper's study: ten per cent.
const SPREAD: f64 = 0.1;
/// Where the random numbers start: fixed, so that an analysis can be repeated.
const SEED: u64 = 2022;

/// A study and what it gave.
#[derive(Debug, Clone)]
pub struct MonteCarlo {
    /// What was varied by how much.
    pub study: Study,
    /// The bands, over all rows.
    pub bands: Vec<Band>,
}

/// Evaluates `draws` machines on all rows.
pub(crate) fn run(machine: &Machine, states: &StateColumns, draws: usize) -> MonteCarlo {
    let study = Study {
        draws,
        spread: SPREAD,
        seed: SEED,
    };
    let drawn = study.machines(machine);
    let blocks: Vec<usize> = (0..states.rows()).step_by(BLOCK_ROWS).collect();
    let parts: Vec<Vec<Band>> = blocks
        .into_par_iter()
        .map(|first| {
            let rows = first..(first + BLOCK_ROWS).min(states.rows());
            bands(machine, &drawn, states, rows)
        })
        .collect();
    let mut parts = parts.into_iter();
    let mut all = parts.next().unwrap_or_default();
    for part in parts {
        for (band, more) in all.iter_mut().zip(part) {
            band.append(more);
        }
    }
    MonteCarlo { study, bands: all }
}
