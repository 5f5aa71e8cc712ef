//! Smooths the samples of a log on all processors.

use std::io;

use rayon::prelude::*;
use tipwatch_mechanics::estimation::{
    BlockSmoother, Pass, ROWS_PER_BLOCK, RowClock, SmoothedBlock, SmoothedRows,
};
use tipwatch_mechanics::state::StateColumns;

use super::loaded::{LoadedLog, Signal};

/// Blocks smoothed at a time for each thread.
const BLOCKS_PER_THREAD: usize = 4;

/// Prepares to smooth a log block by block: [`BlockSmoother::worker`].
///
/// # Errors
/// Samples cannot be read from their temporary file.
pub fn block_smoother(loaded: &LoadedLog, clock: RowClock) -> io::Result<BlockSmoother<&Signal>> {
    let signals = loaded.signals.iter().collect();
    let run = |passes: Vec<Pass<'_>>| {
        rayon::scope(|scope| {
            for pass in passes {
                scope.spawn(|_| pass());
            }
        });
    };
    let (machine, sensors) = (&loaded.machine, &loaded.matched.sensors);
    BlockSmoother::new(machine, sensors, signals, clock, ROWS_PER_BLOCK, &run)
}

/// Smooths a whole log, which must fit in memory.
///
/// # Errors
/// Samples cannot be read from their temporary file.
pub fn smooth(loaded: &LoadedLog, clock: RowClock) -> io::Result<SmoothedRows> {
    let smoother = block_smoother(loaded, clock)?;
    let times_ns = smoother.row_times_ns().to_vec();
    let mut rows = SmoothedRows {
        states: StateColumns::with_capacity(&loaded.machine, times_ns.len()),
        reasons: Vec::with_capacity(times_ns.len()),
        times_ns,
        counts: smoother.counts().collect(),
        faults: smoother.faults().to_vec(),
    };
    let at_once = BLOCKS_PER_THREAD * rayon::current_num_threads();
    for first in (0..smoother.blocks()).step_by(at_once) {
        let blocks = first..smoother.blocks().min(first + at_once);
        let smoothed: Vec<SmoothedBlock> = (blocks.into_par_iter())
            .map_init(
                || smoother.worker(&loaded.machine),
                |worker, block| {
                    let mut rows = SmoothedBlock::empty(&loaded.machine);
                    worker.smooth(block, &mut rows)?;
                    Ok(rows)
                },
            )
            .collect::<io::Result<_>>()?;
        for block in smoothed {
            rows.states.append(&block.states);
            rows.reasons.extend(block.reasons);
        }
    }
    Ok(rows)
}
