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
/// Largest lead of a publication time over this computer's clock. All processes share the clock, so more than a scheduling delay
/// is wrong.
pub const MAX_CLOCK_LEAD_NS: i64 = 5 * MS;
/// Largest lead of a stamp over its publication time, by the clock that the session declares: the producer reads two clocks one
/// after the other. More would hide as much of a delay.
pub const MAX_STAMP_LEAD_NS: i64 = 50 * MS;
/// Data that were measured longer than this before their publication are late (a caution): several periods of the
/// sensors' own buses. Beyond the estimator's longest gap they are stale (a fault).
pub const MAX_DELAY_NS: i64 = 100 * MS;
/// Largest drift of a sensor's smallest delay from that of its first second (beyond it: a caution), due to stamps that run at
/// another speed. One per cent is found after 6 s, a factor of two after 2 s (as late data after 0.2 s).
pub const MAX_DRIFT_NS: i64 = 50 * MS;
/// Largest drift of the clock of the stamps against this computer's that is followed (s/s): crystals are wrong by up to 50 ppm
/// each over temperature and age.
pub const MAX_CLOCK_DRIFT: f64 = 100e-6;
/// Largest drift that is followed in a session of a clock of the stamps that runs slow. Such a drift cannot be told from a delay
/// that grows as slowly for all sensors alike, so a delay of this size may stay unseen: eight hours at half of
/// [`MAX_CLOCK_DRIFT`].
pub const MAX_HIDDEN_DELAY_NS: i64 = 1_500 * MS;
/// The time over which the smallest delay is taken: delays of single samples vary, their minimum does not.
pub const DRIFT_WINDOW_NS: i64 = SECOND;
/// A sensor is late after this many of its periods (a caution) ...
pub const LATE_PERIODS: f64 = 3.0;
/// ... but not before this time (ns): the scheduler alone may delay a fast sensor so long.
pub const MIN_LATE_NS: f64 = 20e6;
/// A sensor is stale after this many of its periods (a fault) ...
pub const STALE_PERIODS: f64 = 10.0;
/// ... but not before this time (ns). The upper bound is the estimator's longest gap.
pub const MIN_STALE_NS: f64 = 50e6;
/// The same upper bound for odometry beside an IMU, for load sensors and for forces of the arm: the estimate goes on without them, with a
/// larger uncertainty or unchecked.
pub const MAX_AUXILIARY_AGE_NS: i64 = 5 * SECOND;
/// An untimed session without samples for this long is stale between rows.
pub const UNTIMED_SILENCE_NS: i64 = SECOND;

// Output: how long consumers may act on a message.

/// A verdict or command is published at least this often: five times within its validity.
pub const HEARTBEAT_NS: i64 = 20 * MS;
/// Time for which a verdict or command may be acted on. A monitor that hangs or dies is noticed after this time.
pub const VALIDITY_NS: i64 = 100 * MS;
/// A verdict or command published later than this after its sample is late: two rows at 100 Hz.
pub const DEADLINE_NS: i64 = 20 * MS;
/// Consecutive late results that are a fault: cycles of the monitor, rows of the control.
pub const PERSISTENT_LATE: u32 = 3;
/// An alarm that has not been on the disk for this long is told (a caution): a sync of a busy disk takes less.
pub const ALARM_SAVE_NS: i64 = SECOND;
/// Time for which a monitor that does not stay tells of a session that it refuses, before the monitor ends.
pub const REFUSAL_NOTICE_NS: i64 = SECOND / 2;
/// Period at which the nodes of dead processes are removed, which reveals a dead producer.
pub const DEAD_NODE_CHECK: Duration = Duration::from_millis(100);
/// The search for them takes one part in so many of a processor: where it meets many files of other programs, it comes less often.
pub const DEAD_NODE_SHARE: u32 = 100;
/// The longest period of the search, whatever it takes.
pub const MAX_DEAD_NODE_CHECK: Duration = Duration::from_secs(1);
/// The longest wait for a notification. A lost one delays a cycle by no more.
pub const MAX_WAIT: Duration = Duration::from_millis(1);

// Active suspension: when valves may follow the optimiser, and how they close. They follow after
// [`GOOD_ROWS`] good rows, as many as the verdict needs before it can be safe.

/// The oldest row that the valves may follow: five rows at 100 Hz.
pub const MAX_ROW_AGE_NS: i64 = 50 * MS;
/// Rate at which valves close on a fault (full openings per second): a fully open valve takes a quarter of a second, which closes
/// it without a pressure surge.
pub const CLOSING_RATE: f64 = 4.0;
/// A command is sent at least this often while valves close, so that they close smoothly.
pub const CLOSING_PERIOD_NS: i64 = 2 * MS;
pub use tipwatch_suspension::{MOVING_OPENING, STILL_ROD_M, STILL_ROD_S, TRIAL_OPENING};
