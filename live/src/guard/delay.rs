//! Delay of a sensor's samples from measurement to publication: bounded absolutely, and in its drift.
//!
//! ```text
//!     delay = published - measured,   measured = clock_host_ns + (stamp - clock_stamp_ns) / pace
//! ```
//! The smallest delay of a second hardly varies, whatever single samples do. If it moves away from that of the
//! first second, the stamps run at another speed than the session declares.

use crate::safety_limits::{DRIFT_WINDOW_NS, MAX_DELAY_NS, MAX_DRIFT_NS, MAX_STAMP_LEAD_NS};

/// What a delay means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Delay {
    InTime,
    Late,
    Stale,
    /// Measured after its publication: the stamp is wrong.
    Ahead,
}

impl Delay {
    /// What this delay (ns) means to an estimator with this longest gap (ns).
    pub(super) fn of(delay_ns: i64, max_gap_ns: i64) -> Self {
        match delay_ns {
            ..0 if delay_ns < -MAX_STAMP_LEAD_NS => Self::Ahead,
            _ if delay_ns > max_gap_ns => Self::Stale,
            _ if delay_ns > MAX_DELAY_NS.min(max_gap_ns) => Self::Late,
            _ => Self::InTime,
        }
    }
}

/// Follows the smallest delay of a sensor, from its first sample on.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct DriftWatch {
    /// Begin of the window (publication time, ns) and the smallest delay in it (ns).
    window: Option<(i64, i64)>,
    /// Smallest delay of the first window (ns).
    first_ns: Option<i64>,
    /// Whether that of the last complete window is too far from it.
    drifts: bool,
}

impl DriftWatch {
    /// Takes a sample's delay (ns); returns whether the delays drift.
    pub(super) fn take(&mut self, published_ns: i64, delay_ns: i64) -> bool {
        let (begin_ns, least_ns) = *self.window.get_or_insert((published_ns, delay_ns));
        if published_ns.saturating_sub(begin_ns) < DRIFT_WINDOW_NS {
            self.window = Some((begin_ns, least_ns.min(delay_ns)));
            return self.drifts;
        }
        let first_ns = *self.first_ns.get_or_insert(least_ns);
        self.drifts = least_ns.abs_diff(first_ns) > MAX_DRIFT_NS.unsigned_abs();
        self.window = Some((published_ns, delay_ns));
        self.drifts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    /// When stamps that run at this speed are found (s), at 100 samples a second whose delays vary.
    fn found_after_s(speed: f64) -> Option<f64> {
        let mut watch = DriftWatch::default();
        let found = (0..6000_i64).find(|sample| {
            let published_ns = sample * 10 * MS;
            let stamp_ns = (published_ns as f64 * speed) as i64;
            let jitter_ns = (sample * 7919 % 40) * MS;
            watch.take(published_ns, published_ns - stamp_ns + jitter_ns)
        });
        found.map(|sample| sample as f64 * 0.01)
    }

    // requirement: TW-FAULT-06
    #[test]
    fn stamps_at_another_speed_are_found_by_their_drift() {
        assert_eq!(found_after_s(1.0), None);
        for (speed, within_s) in [(0.5, 2.1), (2.0, 2.1), (0.99, 7.1), (1.01, 7.1)] {
            let found = found_after_s(speed);
            assert!(found.is_some_and(|s| s <= within_s), "{speed}: {found:?}");
        }
    }

    #[test]
    fn windows_take_the_smallest_delay_up_to_their_end() {
        const END: i64 = DRIFT_WINDOW_NS;
        let far_ns = 2 * MAX_DRIFT_NS;
        for (delay_ns, drifts) in [
            (MAX_DRIFT_NS, false),
            (MAX_DRIFT_NS + 1, true),
            (-MAX_DRIFT_NS, false),
            (-MAX_DRIFT_NS - 1, true),
        ] {
            let mut watch = DriftWatch::default();
            assert!(!watch.take(0, 0));
            // in the first window, however large
            assert!(!watch.take(END / 2, far_ns) && !watch.take(END - 1, far_ns));
            // the first of the second one
            assert!(!watch.take(END, delay_ns));
            assert!(!watch.take(2 * END - 1, far_ns));
            assert_eq!(watch.take(2 * END, 0), drifts, "{delay_ns}");
            // until the next one is complete
            assert_eq!(watch.take(2 * END + 1, 0), drifts);
            assert!(!watch.take(3 * END, 0));
        }
    }
}
