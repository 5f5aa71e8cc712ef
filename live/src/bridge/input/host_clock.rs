//! This computer's Unix time by its monotonic clock: steady within a session, even if somebody sets the clock.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use crate::system::clock::{monotonic_ns, unix_ns};

/// A clock that was set by more than this needs a new session (ns): as far as a stamp may be ahead of its publication.
const SET_NS: i64 = crate::safety_limits::MAX_STAMP_LEAD_NS;

/// Unix time minus CLOCK_MONOTONIC, shared by all threads of the bridge.
#[derive(Debug, Clone)]
pub struct HostClock(Arc<AtomicI64>);

impl Default for HostClock {
    fn default() -> Self {
        Self(Arc::new(AtomicI64::new(ahead_ns())))
    }
}

fn ahead_ns() -> i64 {
    unix_ns().saturating_sub(monotonic_ns())
}

impl HostClock {
    /// Unix time minus CLOCK_MONOTONIC (ns).
    #[must_use]
    pub fn unix_ahead_ns(&self) -> i64 {
        self.0.load(Ordering::Relaxed)
    }

    /// Unix time (ns) of a time by CLOCK_MONOTONIC.
    #[must_use]
    pub fn unix_at(&self, host_ns: i64) -> i64 {
        host_ns.saturating_add(self.unix_ahead_ns())
    }

    /// Reads both clocks anew.
    pub fn update(&self) {
        self.0.store(ahead_ns(), Ordering::Relaxed);
    }

    /// Returns by how much the clock was set since the last update (s); `None` if by no more than 50 ms.
    #[must_use]
    pub fn was_set_by_s(&self) -> Option<f64> {
        let by_ns = ahead_ns().saturating_sub(self.unix_ahead_ns());
        (by_ns.unsigned_abs() > SET_NS.unsigned_abs()).then_some(by_ns as f64 * 1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_was_set_is_noticed() {
        let clock = HostClock::default();
        assert_eq!(clock.was_set_by_s(), None);
        assert_eq!(clock.unix_at(0), clock.unix_ahead_ns());
        clock.0.fetch_add(-2_000_000_000, Ordering::Relaxed);
        let by_s = clock.was_set_by_s().unwrap();
        assert!((by_s - 2.0).abs() < 0.1, "{by_s}");
        clock.update();
        assert_eq!(clock.was_set_by_s(), None);
    }
}
