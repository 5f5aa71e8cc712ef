//! Units and limits of times.

pub(crate) const NS_PER_S: f64 = 1e9;

/// Start of 1990: earlier stamps count from the start of a machine or simulation.
pub(crate) const EARLIEST_DATE_NS: i64 = 631_152_000_000_000_000;

/// Start of 2100: later stamps are not dates.
pub(crate) const LATEST_DATE_NS: i64 = 4_102_444_800_000_000_000;

/// Whether a time is a plausible date for a log.
pub(crate) fn is_date(stamp_ns: i64) -> bool {
    (EARLIEST_DATE_NS..LATEST_DATE_NS).contains(&stamp_ns)
}

/// Subtracts as integers first, because a date in nanoseconds is not exact in an f64.
pub(crate) fn seconds_between(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 / NS_PER_S
}
