//! Consecutive rows that are off, and the shortest run of them that is a contradiction.

use std::collections::VecDeque;

/// Shortest contradiction (ns).
pub const LEAST_NS: i64 = 2_000_000_000;
/// Fewest rows of one.
pub const FEWEST_ROWS: usize = 4;

/// The last rows that are off, without a hole.
#[derive(Debug)]
pub(in crate::studies) struct Run<R> {
    rows: VecDeque<(i64, R)>,
    most: usize,
    /// Stamp of the first row of the run, kept or not (ns).
    since_ns: i64,
}

impl<R> Run<R> {
    /// Creates a run without rows; the last `most` of them are kept.
    pub(in crate::studies) fn new(most: usize) -> Self {
        Self {
            rows: VecDeque::with_capacity(most),
            most,
            since_ns: 0,
        }
    }

    pub(super) fn clear(&mut self) {
        self.rows.clear();
    }

    /// Takes a row that is judged.
    pub(in crate::studies) fn take(&mut self, time_ns: i64, is_off: bool, row: R) {
        let last_ns = self.rows.back().map(|(last_ns, _)| *last_ns);
        if !is_off || last_ns.is_some_and(|last_ns| time_ns.saturating_sub(last_ns) >= LEAST_NS) {
            self.rows.clear();
        }
        if !is_off {
            return;
        }
        if self.rows.is_empty() {
            self.since_ns = time_ns;
        }
        if self.rows.len() == self.most {
            self.rows.pop_front();
        }
        self.rows.push_back((time_ns, row));
    }

    /// The last rows, if they have been off for long enough.
    pub(in crate::studies) fn lasting(&self) -> Option<Vec<&R>> {
        let (last_ns, _) = self.rows.back()?;
        let lasts = last_ns.saturating_sub(self.since_ns) >= LEAST_NS;
        (lasts && self.rows.len() >= FEWEST_ROWS)
            .then(|| self.rows.iter().map(|(_, row)| row).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_must_be_off_for_two_seconds_without_a_hole() {
        let mut run = Run::new(8);
        let mut lasting = |ms: i64, is_off: bool| {
            run.take(1_000_000 * ms, is_off, ms);
            run.lasting()
                .map(|rows| rows.into_iter().copied().collect())
        };
        for ms in (0..2000).step_by(250) {
            assert_eq!(lasting(ms, true), None::<Vec<i64>>);
        }
        let last = |until: i64| (0..8).map(|k| until - 250 * (7 - k)).collect::<Vec<i64>>();
        assert_eq!(lasting(2000, true), Some(last(2000)));
        assert_eq!(lasting(2250, true), Some(last(2250)));
        // one that is not off ends it at once
        assert_eq!(lasting(2500, false), None);
        // and so does a hole
        for ms in [3000, 3600, 4200, 4800] {
            assert_eq!(lasting(ms, true), None);
        }
        assert!(lasting(5400, true).is_some());
        assert_eq!(lasting(7400, true), None);
    }
}
