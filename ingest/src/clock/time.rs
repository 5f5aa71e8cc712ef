//! Units and limits of times.

pub(crate) const NS_PER_S: f64 = 1e9;

/// Start of 1990: stamps before it are counted from the start of something.
pub(crate) const EARLIEST_DATE_NS: i64 = 631_152_000_000_000_000;

/// Start of 2100: no machine has logged after it.
pub(crate) const LATEST_DATE_NS: i64 = 4_102_444_800_000_000_000;

/// Whether a time is a date that a log can have.
pub(crate) fn is_date(stamp_ns: i64) -> bool {
    (EARLIEST_DATE_NS..LATEST_DATE_NS).contains(&stamp_ns)
}

/// Subtracted as integers first: a date in nanoseconds is too large for an exact f64.
pub(crate) fn seconds_between(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 / NS_PER_S
}
