//! Clocks: the monotonic one that all processes of a computer share, and the time of day.

use std::fmt::Debug;

/// A loop's source of time: [`Monotonic`] in the programs, a simulated clock in tests.
pub trait Clock: Debug {
    /// The current time (ns).
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

/// The current time (ns) of CLOCK_MONOTONIC, which is never set back.
#[must_use]
pub fn monotonic_ns() -> i64 {
    clock_ns(libc::CLOCK_MONOTONIC)
}

/// The processor time (ns) that this thread has taken so far.
pub(crate) fn of_thread_ns() -> i64 {
    clock_ns(libc::CLOCK_THREAD_CPUTIME_ID)
}

#[allow(
    unsafe_code,
    reason = "the standard library hides the values of these clocks"
)]
fn clock_ns(clock: libc::clockid_t) -> i64 {
    let mut now = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    // SAFETY: `now` is valid for writes.
    unsafe { libc::clock_gettime(clock, &raw mut now) };
    now.tv_sec
        .saturating_mul(1_000_000_000)
        .saturating_add(now.tv_nsec)
}

/// The time of day (ns since 1970).
#[must_use]
pub fn unix_ns() -> i64 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    since.map_or(0, |since| {
        i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
    })
}

/// Whether a time (ns since 1970) is that of a clock that knows the time of day. Clocks that count from the start of a controller,
/// or have lost their battery, are before the year 2000.
#[must_use]
pub fn knows_the_day(time_ns: i64) -> bool {
    const YEAR_2000_NS: i64 = 946_684_800_000_000_000;
    time_ns >= YEAR_2000_NS
}
