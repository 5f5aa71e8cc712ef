//! Monte Carlo study of parametric uncertainty over a whole log.

use std::collections::BTreeMap;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::studies::monte_carlo::{self, Band, bands};
use tipwatch_mechanics::{ColumnNames, StateColumns};

use super::study::{Block, StudiedLog, Study};

/// Rows of a block that is evaluated in parallel.
const BLOCK_ROWS: usize = 128;
/// Spread of the paper's study: 10 %.
const SPREAD: f64 = 0.1;
/// Fixed seed: analyses are repeatable.
const SEED: u64 = 2022;

/// Monte Carlo study of the parameters.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(rename = "MonteCarloSummary")]
pub struct MonteCarlo {
    /// Number of drawn machines.
    pub draws: usize,
    /// Largest relative deviation of lengths, angles, masses and inertias.
    pub spread: f64,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Half width of the band that contains 95 % of the draws, averaged over the rows, by column of
    /// samples.parquet (N or N m).
    pub mean_half_band: BTreeMap<String, Option<f64>>,
    /// Largest number of draws times rows that could not be evaluated, over all quantities.
    pub left_out: u64,
    /// Bands over all rows.
    #[serde(skip)]
    pub bands: Vec<Band>,
}

/// The drawn machines.
#[derive(Debug)]
pub(super) struct DrawnMachines {
    study: monte_carlo::Study,
    machines: Vec<Machine>,
}

impl DrawnMachines {
    /// Draws the machines.
    pub(super) fn new(machine: &Machine, draws: usize) -> Self {
        let study = monte_carlo::Study {
            draws,
            spread: SPREAD,
            seed: SEED,
        };
        Self {
            machines: study.machines(machine),
            study,
        }
    }

    /// Evaluates the drawn machines on some rows.
    pub(super) fn bands(&self, machine: &Machine, states: &StateColumns) -> Vec<Band> {
        let blocks: Vec<usize> = (0..states.rows()).step_by(BLOCK_ROWS).collect();
        let parts = blocks.into_par_iter().map(|first| {
            let rows = first..(first + BLOCK_ROWS).min(states.rows());
            bands(machine, &self.machines, states, rows)
        });
        let parts: Vec<Vec<Band>> = parts.collect();
        let mut all = Vec::new();
        parts.iter().for_each(|part| append(&mut all, part));
        all
    }

    /// The study with the bands over all rows of a machine.
    pub(super) fn finish(self, machine: &Machine, bands: Vec<Band>) -> MonteCarlo {
        let names = ColumnNames::of(machine);
        let left_out = |band: &Band| band.left_out.iter().map(|&n| u64::from(n)).sum();
        MonteCarlo {
            draws: self.study.draws,
            spread: self.study.spread,
            seed: self.study.seed,
            mean_half_band: (bands.iter())
                .map(|band| (band.quantity.column(&names), mean_half_band(band)))
                .collect(),
            left_out: bands.iter().map(left_out).max().unwrap_or(0),
            bands,
        }
    }
}

fn mean_half_band(band: &Band) -> Option<f64> {
    let ends = band.low.iter().zip(&band.high);
    let widths = ends.map(|(low, high)| 0.5 * (high - low));
    let known: Vec<f64> = widths.filter(|width| width.is_finite()).collect();
    Some(known.iter().sum::<f64>() / known.len() as f64).filter(|mean| mean.is_finite())
}

/// The bands over all rows; none without a study.
impl Study<'_> for Vec<Band> {
    type Found = Self;

    fn begin(_: &StudiedLog<'_>) -> Self {
        Self::new()
    }

    fn take(&mut self, block: &Block<'_>) {
        append(self, &block.bands);
    }
}

/// Appends the bands of the next rows.
fn append(all: &mut Vec<Band>, next: &[Band]) {
    match all.is_empty() {
        true => *all = next.to_vec(),
        false => (all.iter_mut().zip(next)).for_each(|(band, next)| band.append(next)),
    }
}
