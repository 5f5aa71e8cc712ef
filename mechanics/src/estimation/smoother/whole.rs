//! The smoother for a recording that fits in memory.

use super::block::{BlockSmoother, ROWS_PER_BLOCK};
use super::source::SensorSamples;
use crate::estimation::plausibility::FaultSpan;
use crate::estimation::rows::{EstimatedStates, RowClock};
use crate::machine::Machine;
use crate::state::{Sensor, Sensors, StreamCounts};

/// Estimates of all rows.
#[derive(Debug, Clone)]
pub struct SmoothedRows {
    /// Row times (ns).
    pub times_ns: Vec<i64>,
    /// The states of all rows.
    pub estimated: EstimatedStates,
    /// Number of samples used and not used, by sensor.
    pub counts: Vec<(Sensor, StreamCounts)>,
    /// Implausible spans of the signals, sorted by start.
    pub faults: Vec<FaultSpan>,
}

/// Smooths a whole recording with one thread: see [`BlockSmoother`].
#[must_use]
pub fn smooth(
    machine: &Machine,
    sensors: &Sensors,
    recordings: &[SensorSamples<'_>],
    clock: RowClock,
) -> SmoothedRows {
    let sources = recordings.to_vec();
    let Ok(smoother) = BlockSmoother::new(
        machine,
        sensors,
        sources,
        clock,
        ROWS_PER_BLOCK,
        &|passes| passes.into_iter().for_each(|pass| pass()),
    );
    let mut rows = SmoothedRows {
        times_ns: smoother.row_times_ns().to_vec(),
        estimated: EstimatedStates::empty(machine),
        counts: smoother.counts().collect(),
        faults: smoother.faults().to_vec(),
    };
    let mut worker = smoother.worker(machine);
    let mut block = EstimatedStates::empty(machine);
    for k in 0..smoother.blocks() {
        let Ok(()) = worker.smooth(k, &mut block);
        rows.estimated.append(&block);
    }
    rows
}
