//! Smooths the samples of a log on all processors.

use std::io;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use tipwatch_mechanics::estimation::{
    BlockSmoother, Pass, ROWS_PER_BLOCK, RowClock, SampleSource, SmoothedBlock, SmoothedRows,
};
use tipwatch_mechanics::state::{Sensor, StateColumns};

use super::loaded::{LoadedLog, Signal};

/// Blocks smoothed at a time for each thread.
const BLOCKS_PER_THREAD: usize = 4;

/// The samples of a signal, shared by all who read them.
#[derive(Debug, Clone)]
pub struct SharedSignal {
    signals: Arc<Vec<Signal>>,
    index: usize,
}

impl SampleSource for SharedSignal {
    type Error = io::Error;

    fn sensor(&self) -> Sensor {
        self.signals[self.index].sensor
    }

    fn stamps_ns(&self) -> &[i64] {
        &self.signals[self.index].recording.stamps_ns
    }

    fn read(&self, samples: Range<usize>, values: &mut [f64]) -> io::Result<()> {
        self.signals[self.index].recording.read(samples, values)
    }
}

/// Prepares to smooth a log block by block: [`BlockSmoother::worker`].
///
/// # Errors
/// Samples cannot be read from their temporary file.
pub fn block_smoother(
    loaded: &LoadedLog,
    clock: RowClock,
) -> io::Result<BlockSmoother<SharedSignal>> {
    let signals = (0..loaded.signals.len()).map(|index| SharedSignal {
        signals: Arc::clone(&loaded.signals),
        index,
    });
    let run = |passes: Vec<Pass<'_>>| {
        rayon::scope(|scope| {
            for pass in passes {
                scope.spawn(|_| pass());
            }
        });
    };
    let (machine, sensors) = (&loaded.machine, &loaded.matched.sensors);
    let signals = signals.collect();
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
