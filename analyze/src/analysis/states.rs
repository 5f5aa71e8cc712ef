//! The states of the rows of a log: smoothed block by block, or kept where they are few or a causal estimator gave them.

use std::collections::VecDeque;
use std::fmt;
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;
use tipwatch_mechanics::estimation::{BlockSmoother, ROWS_PER_BLOCK, SmoothedBlock};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::{State, StateColumns};

use crate::base::estimated::{EstimatedStates, StateSource};
use crate::load::SharedSignal;

/// Blocks that stay in memory for states that are asked for one by one.
const MOST_KEPT: usize = 8;
/// Most numbers of states that are smoothed once and kept: those of a few minutes of a usual machine, 32 MB.
const MOST_NUMBERS_KEPT: usize = 4 << 20;

/// The states of a log: smoothed now and kept if they are few, else whenever they are asked for.
pub(super) fn smoothed(
    machine: &Machine,
    smoother: BlockSmoother<SharedSignal>,
) -> Arc<dyn StateSource> {
    let numbers = smoother.row_times_ns().len() * State::<f64>::size(machine);
    let states = SmoothedStates::new(machine, smoother);
    match numbers <= MOST_NUMBERS_KEPT {
        true => Arc::new(states.all()),
        false => Arc::new(states),
    }
}

/// States that are smoothed when they are asked for.
struct SmoothedStates {
    machine: Machine,
    smoother: BlockSmoother<SharedSignal>,
    recent: Mutex<VecDeque<(usize, Arc<SmoothedBlock>)>>,
    failure: Mutex<Option<String>>,
}

impl fmt::Debug for SmoothedStates {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("SmoothedStates")
            .finish_non_exhaustive()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // no code panics while holding one
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl SmoothedStates {
    fn new(machine: &Machine, smoother: BlockSmoother<SharedSignal>) -> Self {
        Self {
            machine: machine.clone(),
            smoother,
            recent: Mutex::default(),
            failure: Mutex::default(),
        }
    }

    /// All states.
    fn all(self) -> KeptStates {
        let blocks = (0..self.smoother.blocks()).into_par_iter();
        let blocks: Vec<SmoothedBlock> = blocks.map(|block| self.block(block)).collect();
        let count = self.smoother.row_times_ns().len();
        let mut kept = KeptStates {
            states: StateColumns::with_capacity(&self.machine, count),
            reasons: Vec::with_capacity(count),
            failure: self.failure(),
        };
        for block in blocks {
            kept.states.append(&block.states);
            kept.reasons.extend(block.reasons);
        }
        kept
    }

    fn block(&self, block: usize) -> SmoothedBlock {
        let mut rows = SmoothedBlock::empty(&self.machine);
        let mut worker = self.smoother.worker(&self.machine);
        if let Err(error) = worker.smooth(block, &mut rows) {
            let count = self.smoother.rows(block).len();
            rows.states = StateColumns::unknown(&self.machine, count);
            rows.reasons.resize(count, Reasons::NONE);
            lock(&self.failure).get_or_insert(error.to_string());
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
        let mut parts = blocks.map(|block| self.part(block, &rows));
        let mut found = parts.next().unwrap_or_else(|| EstimatedStates {
            states: StateColumns::unknown(&self.machine, 0),
            reasons: Vec::new(),
        });
        for part in parts {
            found.states.append(&part.states);
            found.reasons.extend(part.reasons);
        }
        found
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
        let part = rows.start.max(all.start) - all.start..rows.end.min(all.end) - all.start;
        if part.len() == all.len() {
            let SmoothedBlock {
                states, reasons, ..
            } = self.block(block);
            return EstimatedStates { states, reasons };
        }
        let smoothed = self.recent(block);
        EstimatedStates {
            states: smoothed.states.block(part.clone()),
            reasons: smoothed.reasons[part].to_vec(),
        }
    }

    /// A block, kept for those who ask for its neighbours next.
    fn recent(&self, block: usize) -> Arc<SmoothedBlock> {
        let kept = |recent: &mut VecDeque<(usize, Arc<SmoothedBlock>)>| {
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

/// States that are kept.
#[derive(Debug)]
pub(super) struct KeptStates {
    pub(super) states: StateColumns,
    pub(super) reasons: Vec<Reasons>,
    /// Why they could not be read, if so.
    pub(super) failure: Option<String>,
}

impl StateSource for KeptStates {
    fn rows_at_once(&self) -> usize {
        ROWS_PER_BLOCK
    }

    fn read(&self, rows: Range<usize>) -> EstimatedStates {
        EstimatedStates {
            states: self.states.block(rows.clone()),
            reasons: self.reasons[rows].to_vec(),
        }
    }

    fn state(&self, row: usize, state: &mut State<f64>) {
        self.states.get(row, state);
    }

    fn failure(&self) -> Option<String> {
        self.failure.clone()
    }
}
