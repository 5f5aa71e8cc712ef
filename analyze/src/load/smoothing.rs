//! Prepares the samples of a log for smoothing on all processors.

use std::io;
use std::ops::Range;
use std::sync::Arc;

use tipwatch_mechanics::estimation::{BlockSmoother, Pass, ROWS_PER_BLOCK, RowClock, SampleSource};
use tipwatch_mechanics::state::Sensor;

use super::loaded::{LoadedLog, Signal};

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

/// All signals of a log.
#[must_use]
pub fn shared_signals(loaded: &LoadedLog) -> Vec<SharedSignal> {
    let signals = (0..loaded.signals.len()).map(|index| SharedSignal {
        signals: Arc::clone(&loaded.signals),
        index,
    });
    signals.collect()
}

/// Prepares to smooth a log block by block: [`BlockSmoother::worker`].
///
/// # Errors
/// Samples cannot be read from their temporary file.
pub fn block_smoother(
    loaded: &LoadedLog,
    clock: RowClock,
) -> io::Result<BlockSmoother<SharedSignal>> {
    let signals = shared_signals(loaded);
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
