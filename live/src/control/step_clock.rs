//! When the optimiser is asked next.

/// Steps of equal length in the time of rows, which do not come in step with it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StepClock {
    /// Time of the row at which the next step is due (ns).
    due_ns: i64,
}

impl StepClock {
    /// The next step is due with this row.
    pub(super) fn restart(&mut self, time_ns: i64) {
        self.due_ns = time_ns;
    }

    /// Whether a step of this length (s) is due with this row. A late row does not delay the steps after it; of many
    /// missed steps two are made up for.
    pub(super) fn is_due(&mut self, time_ns: i64, length_s: f64) -> bool {
        if time_ns < self.due_ns {
            return false;
        }
        let length_ns = (length_s * 1e9) as i64;
        let earliest_ns = time_ns.saturating_sub(length_ns);
        self.due_ns = self.due_ns.saturating_add(length_ns).max(earliest_ns);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rows (ms) with which a step of 20 ms is due.
    fn due(rows_ms: &[i64]) -> Vec<i64> {
        let mut clock = StepClock::default();
        clock.restart(rows_ms[0] * 1_000_000);
        let is_due = |ms: &i64| clock.is_due(ms * 1_000_000, 0.02);
        rows_ms.iter().copied().filter(is_due).collect()
    }

    #[test]
    fn steps_keep_their_length_whenever_rows_come() {
        assert_eq!(due(&[0, 10, 20, 30, 40, 50]), [0, 20, 40]);
        assert_eq!(due(&[0, 19, 21, 39, 40, 59]), [0, 21, 40]);
        // from the row that it was started with
        assert_eq!(due(&[1000, 1001, 1002, 1019, 1020]), [1000, 1020]);
        // rows slower than the steps
        assert_eq!(due(&[0, 40, 80, 120]), [0, 40, 80, 120]);
    }

    #[test]
    fn two_missed_steps_are_made_up_for() {
        let after_a_gap = [0, 80, 81, 82, 83, 100, 101];
        assert_eq!(due(&after_a_gap), [0, 80, 81, 82, 100]);
    }
}
