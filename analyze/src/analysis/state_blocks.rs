//! The states of the rows of a log: smoothed block by block, or kept where they are few or a causal estimator gave them.

use std::collections::VecDeque;
use std::fmt;
use std::ops::Range;
use std::sync::{Arc, Mutex, OnceLock};

use rayon::prelude::*;
use tipwatch_mechanics::estimation::{BlockSmoother, EstimatedStates, ROWS_PER_BLOCK};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::{State, StateColumns};

use crate::base::lock::lock;
use crate::base::scratch_file::ScratchFile;
use crate::base::state_source::StateSource;
use crate::base::table::BLOCK_ROWS;
use crate::load::SharedSignal;

/// Blocks that stay in memory for single requests of states.
const MOST_KEPT: usize = 8;
/// Most numbers of states that are smoothed once and kept: those of a few minutes of a usual machine, 32 MB.
const MOST_NUMBERS_KEPT: usize = 4 << 20;

/// States of a log: smoothed at once and kept if they are few, else smoothed on request.
pub(super) fn smoothed(
    machine: &Machine,
    smoother: BlockSmoother<SharedSignal>,
) -> Arc<dyn StateSource> {
    let numbers = smoother.row_times_ns().len() * State::<f64>::size(machine);
    let states = SmoothedStates::new(machine, smoother);
    match numbers <= MOST_NUMBERS_KEPT {
        true => Arc::new(states.all()),
        false => Arc::new(states.keeping()),
    }
}

/// States that are smoothed on request.
struct SmoothedStates {
    machine: Machine,
    smoother: BlockSmoother<SharedSignal>,
    recent: Mutex<VecDeque<(usize, Arc<EstimatedStates>)>>,
    /// Blocks that were smoothed before.
    kept: Option<KeptBlocks>,
    failure: Mutex<Option<String>>,
}

impl fmt::Debug for SmoothedStates {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("SmoothedStates")
            .finish_non_exhaustive()
    }
}

impl SmoothedStates {
    fn new(machine: &Machine, smoother: BlockSmoother<SharedSignal>) -> Self {
        Self {
            machine: machine.clone(),
            smoother,
            recent: Mutex::default(),
            kept: None,
            failure: Mutex::default(),
        }
    }

    /// Keeps blocks that are smoothed from now on.
    fn keeping(mut self) -> Self {
        let (blocks, columns) = (self.smoother.blocks(), State::<f64>::size(&self.machine));
        self.kept = Some(KeptBlocks::new(blocks, ROWS_PER_BLOCK, columns));
        self
    }

    /// All states.
    fn all(self) -> KeptStates {
        let blocks = (0..self.smoother.blocks()).into_par_iter();
        KeptStates {
            machine: self.machine.clone(),
            blocks: blocks.map(|block| self.block(block)).collect(),
            rows_per_block: ROWS_PER_BLOCK,
            failure: self.failure(),
        }
    }

    fn block(&self, block: usize) -> EstimatedStates {
        let kept = self.kept.as_ref();
        if let Some(known) = kept.and_then(|kept| kept.read(block)) {
            return known;
        }
        let mut rows = EstimatedStates::empty(&self.machine);
        let mut worker = self.smoother.worker(&self.machine);
        match worker.smooth(block, &mut rows) {
            Ok(()) => {
                if let Some(kept) = kept {
                    kept.keep(block, &rows);
                }
            }
            Err(error) => {
                let count = self.smoother.rows(block).len();
                rows.states = StateColumns::unknown(&self.machine, count);
                rows.reasons.resize(count, Reasons::NONE);
                lock(&self.failure).get_or_insert(error.to_string());
            }
        }
        rows
    }
}

impl StateSource for SmoothedStates {
    fn rows_at_once(&self) -> usize {
        ROWS_PER_BLOCK
    }

    fn read(&self, rows: Range<usize>) -> EstimatedStates {
        let blocks = rows.start / ROWS_PER_BLOCK..rows.end.div_ceil(ROWS_PER_BLOCK);
        joined(blocks.map(|block| self.part(block, &rows)), &self.machine)
    }

    fn state(&self, row: usize, state: &mut State<f64>) {
        let block = row / ROWS_PER_BLOCK;
        let first = self.smoother.rows(block).start;
        self.recent(block).states.get(row - first, state);
    }

    fn failure(&self) -> Option<String> {
        lock(&self.failure).clone()
    }
}

impl SmoothedStates {
    /// The states of `rows` that are in a block.
    fn part(&self, block: usize, rows: &Range<usize>) -> EstimatedStates {
        let all = self.smoother.rows(block);
        let part = within(&all, rows);
        if part.len() == all.len() {
            return self.block(block);
        }
        self.recent(block).part(part)
    }

    /// A block, kept for those who ask for its neighbours next.
    fn recent(&self, block: usize) -> Arc<EstimatedStates> {
        let kept = |recent: &mut VecDeque<(usize, Arc<EstimatedStates>)>| {
            let place = recent.iter().position(|(known, _)| *known == block)?;
            let found = recent.remove(place)?;
            recent.push_front(found);
            recent.front().map(|(_, rows)| Arc::clone(rows))
        };
        if let Some(known) = kept(&mut lock(&self.recent)) {
            return known;
        }
        let rows = Arc::new(self.block(block));
        let mut recent = lock(&self.recent);
        recent.push_front((block, Arc::clone(&rows)));
        recent.truncate(MOST_KEPT);
        rows
    }
}

/// States that are kept, in blocks.
#[derive(Debug)]
pub(super) struct KeptStates {
    machine: Machine,
    blocks: Vec<EstimatedStates>,
    rows_per_block: usize,
    /// Error of reading the states, if there was one.
    failure: Option<String>,
}

impl KeptStates {
    /// All states in one block.
    pub(super) fn of(machine: &Machine, states: EstimatedStates) -> Self {
        Self {
            machine: machine.clone(),
            rows_per_block: states.reasons.len().max(1),
            blocks: vec![states],
            failure: None,
        }
    }
}

impl StateSource for KeptStates {
    fn rows_at_once(&self) -> usize {
        BLOCK_ROWS
    }

    fn read(&self, rows: Range<usize>) -> EstimatedStates {
        let length = self.rows_per_block;
        let blocks = rows.start / length..rows.end.div_ceil(length);
        let part = |block: usize| {
            let all = block * length..(block + 1) * length;
            self.blocks[block].part(within(&all, &rows))
        };
        joined(blocks.map(part), &self.machine)
    }

    fn state(&self, row: usize, state: &mut State<f64>) {
        let block = &self.blocks[row / self.rows_per_block];
        block.states.get(row % self.rows_per_block, state);
    }

    fn failure(&self) -> Option<String> {
        self.failure.clone()
    }
}

/// The part of `rows` in a block of the rows `all`, counted from its first one.
fn within(all: &Range<usize>, rows: &Range<usize>) -> Range<usize> {
    rows.start.max(all.start) - all.start..rows.end.min(all.end) - all.start
}

/// Consecutive states, one after the other.
fn joined(mut parts: impl Iterator<Item = EstimatedStates>, machine: &Machine) -> EstimatedStates {
    let mut joined = (parts.next()).unwrap_or_else(|| EstimatedStates::empty(machine));
    parts.for_each(|part| joined.append(&part));
    joined
}

/// The blocks that were smoothed so far. Without a file, none are kept.
#[derive(Debug)]
struct KeptBlocks {
    file: Option<ScratchFile>,
    /// Length of the file for each block (bytes).
    block_bytes: u64,
    blocks: Vec<OnceLock<Block>>,
}

/// The part of a block that is in memory.
#[derive(Debug)]
struct Block {
    reasons: Vec<Reasons>,
    /// Number of each column whose rows all have the same one, to the bit: most quantities that no sensor measures. The other
    /// columns are in the file, tile by tile.
    constants: Vec<Option<f64>>,
}

impl KeptBlocks {
    /// Room for `blocks` of at most `rows` rows.
    fn new(blocks: usize, rows: usize, columns: usize) -> Self {
        Self {
            // smoothing again costs time, and nothing else
            file: ScratchFile::new().ok(),
            block_bytes: (rows.next_multiple_of(StateColumns::TILE) * columns * size_of::<f64>())
                as u64,
            blocks: (0..blocks).map(|_| OnceLock::new()).collect(),
        }
    }

    /// Keeps a block, unless it is kept already or cannot be written.
    fn keep(&self, block: usize, rows: &EstimatedStates) {
        let (Some(file), None) = (&self.file, self.blocks[block].get()) else {
            return;
        };
        let (constants, varying) = rows.states.constant_and_varying();
        let place = block as u64 * self.block_bytes;
        if (file.write_at(bytemuck::cast_slice(&varying), place)).is_err() {
            return;
        }
        // whoever kept it meanwhile wrote the same bytes
        let _ = self.blocks[block].set(Block {
            reasons: rows.reasons.clone(),
            constants,
        });
    }

    /// A block; `None` if it is not kept, or cannot be read.
    fn read(&self, block: usize) -> Option<EstimatedStates> {
        let (file, kept) = (self.file.as_ref()?, self.blocks[block].get()?);
        let rows = kept.reasons.len();
        let varying = kept.constants.iter().filter(|c| c.is_none()).count();
        let mut varying =
            vec![[0.0; StateColumns::TILE]; varying * rows.div_ceil(StateColumns::TILE)];
        let place = block as u64 * self.block_bytes;
        (file.read_at(bytemuck::cast_slice_mut(&mut varying), place)).ok()?;
        let states = StateColumns::of_constant_and_varying(rows, &kept.constants, &varying);
        Some(EstimatedStates {
            states,
            reasons: kept.reasons.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use tipwatch_binding::MachineFile;
    use tipwatch_mechanics::estimation::RowClock;

    use super::*;
    use crate::base::options::Estimator;
    use crate::load::{block_smoother, load};

    #[test]
    fn kept_states_are_those_that_were_smoothed() {
        let log = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/tiny.mcap");
        let file = MachineFile::read(&log.with_extension("toml")).unwrap();
        let log = file.open_log(&log).unwrap();
        let loaded = load(&log, &file, Estimator::Smoother, &mut |_| {}).unwrap();
        // at this rate there are several blocks
        let states = || {
            let smoother = block_smoother(&loaded, RowClock::Rate(1500.0)).unwrap();
            SmoothedStates::new(&loaded.machine, smoother)
        };
        let (once, keeping, all) = (states(), states().keeping(), states().all());
        let rows = once.smoother.row_times_ns().len();
        assert!(rows > 2 * ROWS_PER_BLOCK, "{rows}");
        let numbers = |states: &dyn StateSource, rows: Range<usize>| {
            let found = states.read(rows);
            let columns = 0..found.states.width();
            let values = columns.flat_map(|column| found.states.column(column));
            let bits: Vec<u64> = values.map(f64::to_bits).collect();
            (bits, format!("{:?}", found.reasons))
        };
        for rows in [0..rows, 0..rows, ROWS_PER_BLOCK - 3..ROWS_PER_BLOCK + 7] {
            let expected = numbers(&once, rows.clone());
            assert_eq!(numbers(&keeping, rows.clone()), expected);
            assert_eq!(numbers(&all, rows), expected);
        }
        let kept = keeping.kept.as_ref().unwrap();
        let is_kept = |block| kept.read(block).is_some();
        assert!((0..once.smoother.blocks()).all(is_kept));
    }
}
