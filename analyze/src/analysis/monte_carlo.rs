//! Monte Carlo study of parametric uncertainty over a whole log.

use rayon::prelude::*;
use tipwatch_mechanics::StateColumns;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::studies::monte_carlo::{Band, Study, bands};

/// Rows of a block that is evaluated in parallel.
const BLOCK_ROWS: usize = 128;
/// Spread of the paper's study: 10 %.
const SPREAD: f64 = 0.1;
/// Fixed seed: analyses are repeatable.
const SEED: u64 = 2022;

/// A study and its result.
#[derive(Debug, Clone)]
pub struct MonteCarlo {
    /// Draws, spread and seed.
    pub study: Study,
    /// Bands over all rows.
    pub bands: Vec<Band>,
}

/// A study while the rows are computed block by block.
#[derive(Debug)]
pub(crate) struct MonteCarloPass {
    study: Study,
    drawn: Vec<Machine>,
}

impl MonteCarloPass {
    /// Draws the machines.
    pub(crate) fn new(machine: &Machine, draws: usize) -> Self {
        let study = Study {
            draws,
            spread: SPREAD,
            seed: SEED,
        };
        Self {
            study,
            drawn: study.machines(machine),
        }
    }

    /// Evaluates the drawn machines on some rows.
    pub(crate) fn bands(&self, machine: &Machine, states: &StateColumns) -> Vec<Band> {
        let blocks: Vec<usize> = (0..states.rows()).step_by(BLOCK_ROWS).collect();
        let parts: Vec<Vec<Band>> = blocks
            .into_par_iter()
            .map(|first| {
                let rows = first..(first + BLOCK_ROWS).min(states.rows());
                bands(machine, &self.drawn, states, rows)
            })
            .collect();
        joined(parts)
    }

    /// The study over all rows, of which `parts` are the blocks in order.
    pub(crate) fn finish(self, parts: Vec<Vec<Band>>) -> MonteCarlo {
        MonteCarlo {
            study: self.study,
            bands: joined(parts),
        }
    }
}

fn joined(parts: Vec<Vec<Band>>) -> Vec<Band> {
    let mut parts = parts.into_iter();
    let mut all = parts.next().unwrap_or_default();
    for part in parts {
        for (band, more) in all.iter_mut().zip(part) {
            band.append(more);
        }
    }
    all
}
