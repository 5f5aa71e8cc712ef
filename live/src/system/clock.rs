//! The clock that all processes of a computer share.

use std::fmt::Debug;

/// Where a loop has its time from. The program's is [`Monotonic`]; a test may steer one of its own.
pub trait Clock: Debug {
    /// Now (ns).
    fn now_ns(&self) -> i64;
}

/// CLOCK_MONOTONIC.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Monotonic;

impl Clock for Monotonic {
    fn now_ns(&self) -> i64 {
        monotonic_ns()
    }
}

/// Now (ns), by CLOCK_MONOTONIC: no time of day, and never set back.
#[must_use]
#[allow(
    unsafe_code,
    reason = "the standard library does not tell this clock's value"
)]
pub fn monotonic_ns() -> i64 {
    let mut now = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    // SAFETY: `now` may be written.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut now) };
    now.tv_sec
        .saturating_mul(1_000_000_000)
        .saturating_add(now.tv_nsec)
}

/// Now (ns since 1970), by the computer's time of day.
#[must_use]
pub fn unix_ns() -> i64 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    since.map_or(0, |since| {
        i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
    })
}
