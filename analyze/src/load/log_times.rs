//! Conversion from the clock of an analysis back to the times of the log.

/// Distance of two points (ns): between them both clocks are taken to run evenly.
const SPACING_NS: i64 = 100_000_000;
/// Most points; beyond it every second one is dropped.
const MAX_POINTS: usize = 1 << 17;

/// Points of both clocks: time of measurement, on the clock of the analysis, and when the recorder received the sample.
#[derive(Debug, Clone)]
pub struct LogTimes {
    points: Vec<(i64, i64)>,
    spacing_ns: i64,
}

impl Default for LogTimes {
    fn default() -> Self {
        Self {
            points: Vec::new(),
            spacing_ns: SPACING_NS,
        }
    }
}

impl LogTimes {
    /// Adds a sample.
    pub(super) fn push(&mut self, stamp_ns: i64, log_ns: i64) {
        let is_near = |&(stamp, log): &(i64, i64)| {
            stamp.abs_diff(stamp_ns) < self.spacing_ns.unsigned_abs()
                && log.abs_diff(log_ns) < self.spacing_ns.unsigned_abs()
        };
        if self.points.last().is_some_and(is_near) {
            return;
        }
        self.points.push((stamp_ns, log_ns));
        if self.points.len() > MAX_POINTS {
            let mut is_kept = false;
            self.points.retain(|_| {
                is_kept = !is_kept;
                is_kept
            });
            self.spacing_ns = self.spacing_ns.saturating_mul(2);
        }
    }

    /// Shifts the clock of the analysis.
    pub(super) fn shift(&mut self, shift_ns: i64) {
        for (stamp_ns, _) in &mut self.points {
            *stamp_ns = stamp_ns.saturating_add(shift_ns);
        }
    }

    /// Puts the points in order, once all are there.
    pub(super) fn finish(&mut self) {
        self.points.sort_unstable();
    }

    /// The time of the log (ns) at a time of the analysis; the same time without points. Before the first point and
    /// behind the last one both clocks are taken to run alike.
    #[must_use]
    pub fn log_ns(&self, stamp_ns: i64) -> i64 {
        let next = self.points.partition_point(|(stamp, _)| *stamp <= stamp_ns);
        let (before, after) = (
            next.checked_sub(1).map(|k| self.points[k]),
            self.points.get(next),
        );
        match (before, after) {
            (Some((stamp, log)), Some(&(next_stamp, next_log))) if next_stamp > stamp => {
                let share = (stamp_ns - stamp) as f64 / (next_stamp - stamp) as f64;
                log.saturating_add((share * next_log.saturating_sub(log) as f64) as i64)
            }
            (Some((stamp, log)), _) | (None, Some(&(stamp, log))) => {
                log.saturating_add(stamp_ns.saturating_sub(stamp))
            }
            (None, None) => stamp_ns,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_the_log_are_found_through_offset_and_drift() {
        let mut times = LogTimes::default();
        let log_of = |stamp: i64| 5_000_000_000_000 + stamp + stamp / 10_000;
        for sample in 0..10_000 {
            let stamp = sample * 10_000_000;
            times.push(stamp, log_of(stamp));
        }
        times.finish();
        for stamp in [0, 123_456_789, 50_000_000_000, 99_000_000_000] {
            let off = times.log_ns(stamp).abs_diff(log_of(stamp));
            assert!(off < 10_000, "{stamp}: {off} ns");
        }
        assert_eq!(times.log_ns(-1_000), log_of(0) - 1_000);
        assert_eq!(LogTimes::default().log_ns(7), 7);
    }

    #[test]
    fn a_long_log_needs_no_more_memory() {
        let mut times = LogTimes::default();
        for sample in 0..1_000_000 {
            times.push(sample * SPACING_NS, sample * SPACING_NS + 3);
        }
        times.finish();
        assert!(times.points.len() <= MAX_POINTS);
        assert_eq!(times.log_ns(77_777_777_777), 77_777_777_780);
    }
}
