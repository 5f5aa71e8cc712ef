//! Every limit that safety rests on: its value, its unit and the reason for it.
//!
//! Times are in nanoseconds of CLOCK_MONOTONIC unless stated otherwise. Limits of the verdict itself, which
//! offline analysis shares, stand in [`tipwatch_mechanics::verdict::limits`].

use std::time::Duration;

pub use tipwatch_mechanics::verdict::limits::{GOOD_ROWS, PERSISTENT, START_UP_NS};

const MS: i64 = 1_000_000;
const SECOND: i64 = 1_000_000_000;

// Input: when a message or a sensor can no longer be trusted.

/// Samples lost within [`LOSS_WINDOW_NS`] that are tolerated. So few only widen the estimate's uncertainty.
pub const MAX_LOST_SAMPLES: u64 = 10;
/// The time over which lost samples are counted.
pub const LOSS_WINDOW_NS: i64 = SECOND;
/// How far ahead of this computer's clock a publication time may be. All processes share the clock, so
/// more than a scheduling delay is wrong.
pub const MAX_CLOCK_LEAD_NS: i64 = 5 * MS;
/// How long a sensor's clock must stay ahead before it is believed again: a corrected clock, not a spike.
pub const CLOCK_SETTLE_NS: i64 = SECOND;
/// A sensor is late after this many of its periods (a caution) ...
pub const LATE_PERIODS: f64 = 3.0;
/// ... but not before this time (ns): the scheduler alone may delay a fast sensor so long.
pub const MIN_LATE_NS: f64 = 20e6;
/// A sensor is stale after this many of its periods (a fault) ...
pub const STALE_PERIODS: f64 = 10.0;
/// ... but not before this time (ns). The upper bound is the estimator's longest gap.
pub const MIN_STALE_NS: f64 = 50e6;

// Output: how long consumers may act on a message.

/// A verdict or command is published at least this often: five times within its validity.
pub const HEARTBEAT_NS: i64 = 20 * MS;
/// How long a verdict or command may be acted on. A monitor that hangs or dies is noticed after this time.
pub const VALIDITY_NS: i64 = 100 * MS;
/// A verdict or command published later than this after its sample is late: two rows at 100 Hz.
pub const DEADLINE_NS: i64 = 20 * MS;
/// Consecutive late results that are a fault: cycles of the monitor, rows of the control.
pub const PERSISTENT_LATE: u32 = 3;
/// How often the nodes of dead processes are removed, which is what reveals a dead producer.
pub const DEAD_NODE_CHECK: Duration = Duration::from_millis(100);
/// The longest wait for a notification. A lost one delays a cycle by no more.
pub const MAX_WAIT: Duration = Duration::from_millis(1);

// Active suspension: when valves may follow the optimiser, and how they close. They follow after
// [`GOOD_ROWS`] good rows, as many as the verdict needs before it can be safe.

/// The oldest row that the valves may follow: five rows at 100 Hz.
pub const MAX_ROW_AGE_NS: i64 = 50 * MS;
/// How fast valves close on a fault (full openings per second): a fully open valve takes a quarter of a
/// second, which closes it without a pressure surge.
pub const CLOSING_RATE: f64 = 4.0;
/// A command is sent at least this often while valves close, so that they close smoothly.
pub const CLOSING_PERIOD_NS: i64 = 2 * MS;
pub use tipwatch_suspension::{MOVING_OPENING, STILL_ROD_M, STILL_ROD_S, TRIAL_OPENING};
