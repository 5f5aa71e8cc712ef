//! Limits on which a verdict rests: value, unit and reason. The live programs use the same ones.

/// Consecutive good rows required before the level can be safe: 0.1 s at 100 Hz, so that a single good row
/// between faults never reads as safe.
pub const GOOD_ROWS: u32 = 10;
/// Time after start during which a missing sensor is not yet a fault (ns). Long enough for a machine's
/// drivers to start one after the other.
pub const START_UP_NS: i64 = 2_000_000_000;
/// Consecutive bad rows or messages of one kind from which they are a fault. One or two are a glitch and are
/// left out.
pub const PERSISTENT: u32 = 3;
/// Hysteresis: how far the utilisation must fall below a threshold before the alarm is released.
pub const RELEASE_BELOW: f64 = 0.02;
/// Time for which it must stay there (ns), so that an alarm does not flicker. Faults and cautions are held as
/// long.
pub const HOLD_NS: i64 = 1_000_000_000;
