//! The results of consecutive rows of a log: of a block, of a window or of the whole log.

use std::ops::Range;

use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::verdict::{Conditions, Verdict};
use tipwatch_mechanics::{OutcomeColumns, Quantity, Scope, StateColumns};

use super::predicted::Predictions;
use super::support_sets::SupportSet;

/// Results of consecutive rows. Rows are counted from the first of these.
#[derive(Debug, Clone)]
pub struct Rows {
    /// Index of the first of these rows in the log.
    pub first: usize,
    /// Time (ns) of the first row of the log.
    pub start_ns: i64,
    /// Times (ns) on the clock of the stamps.
    pub times_ns: Vec<i64>,
    /// Reasons why a row is not valid; empty for a valid row.
    pub reasons: Vec<Reasons>,
    /// The states.
    pub states: StateColumns,
    /// Wheel loads and stability; NaN if not computable.
    pub outcomes: OutcomeColumns,
    /// Verdict of each row; `None` for models without uncertainty, which a verdict needs.
    pub verdicts: Option<Verdicts>,
}

/// Declares the number of rows of a type, their times, and which of them are valid.
macro_rules! counted_rows {
    ($of:ident) => {
        impl $of {
            /// Number of rows.
            #[must_use]
            pub fn len(&self) -> usize {
                self.times_ns.len()
            }

            /// Whether there are no rows.
            #[must_use]
            pub fn is_empty(&self) -> bool {
                self.times_ns.is_empty()
            }

            /// Whether a row is valid, as far as its reasons are known.
            #[must_use]
            pub fn is_valid(&self, row: usize) -> bool {
                self.reasons[row].leave_valid()
            }

            /// Time of a row (s) after the first one.
            #[must_use]
            pub fn seconds(&self, row: usize) -> f64 {
                self.seconds_at(self.times_ns[row])
            }
        }
    };
}

pub(super) use counted_rows;

counted_rows!(Rows);

impl Rows {
    /// The row at a time, or the next one.
    #[must_use]
    pub fn at(&self, time_ns: i64) -> usize {
        row_at(&self.times_ns, time_ns)
    }

    /// A time (ns) on the clock of the stamps, in seconds after the first row of the log.
    fn seconds_at(&self, time_ns: i64) -> f64 {
        (time_ns - self.start_ns) as f64 * 1e-9
    }

    /// A result of a row; NaN where it cannot be computed, or if the model has no such quantity.
    #[must_use]
    pub fn value(&self, quantity: Quantity, row: usize) -> f64 {
        let found = self.outcomes.known_column(quantity);
        found.map_or(f64::NAN, |column| column[row])
    }

    /// Some of these rows on one set of supports, without verdicts.
    pub(crate) fn on_set(&self, set: &SupportSet, scope: Scope, rows: Range<usize>) -> Self {
        let chosen = self.outcomes.chosen(&set.machine, scope, &set.places);
        Self {
            first: self.first + rows.start,
            start_ns: self.start_ns,
            times_ns: self.times_ns[rows.clone()].to_vec(),
            reasons: self.reasons[rows.clone()].to_vec(),
            states: self.states.block(rows.clone()),
            outcomes: chosen.block(rows),
            verdicts: None,
        }
    }

    /// Appends a row of `other`, without its verdict.
    pub(crate) fn push(&mut self, other: &Self, row: usize) {
        self.times_ns.push(other.times_ns[row]);
        self.reasons.push(other.reasons[row]);
        self.states.append(&other.states.block(row..row + 1));
        let columns = self.outcomes.columns.iter_mut();
        for (column, more) in columns.zip(&other.outcomes.columns) {
            column.push(more[row]);
        }
    }

    /// Appends the rows that follow these.
    pub fn append(&mut self, next: Self) {
        self.times_ns.extend(next.times_ns);
        self.reasons.extend(next.reasons);
        self.states.append(&next.states);
        self.outcomes.append(next.outcomes);
        if let (Some(verdicts), Some(next)) = (&mut self.verdicts, next.verdicts) {
            verdicts.append(next);
        }
    }
}

/// The first of some rising times (ns) that is not before `time_ns`, or the last one.
pub(crate) fn row_at(times_ns: &[i64], time_ns: i64) -> usize {
    let row = times_ns.partition_point(|&t| t < time_ns);
    row.min(times_ns.len().saturating_sub(1))
}

/// The last of some values, in order of their times (ns), until a time.
pub(crate) fn last_until<T>(values: &[(i64, T)], time_ns: i64) -> Option<&(i64, T)> {
    let later = values.partition_point(|(from_ns, _)| *from_ns <= time_ns);
    values[..later].last()
}

/// Verdicts of a monitor, row by row.
#[derive(Debug, Clone, Default)]
pub struct Verdicts {
    /// Levels.
    pub verdicts: Vec<Verdict>,
    /// Time (s) until the first wheel lifts off if its load keeps falling at the current rate; NaN if
    /// more than five seconds, or unknown.
    pub time_to_lift_off_s: Vec<f64>,
    /// Predictions; `None` for an estimator that knows what follows, which predicts nothing.
    pub predictions: Option<Predictions>,
    /// Input faults that the monitor recorded in the log for each row; empty for a log without a monitor.
    pub recorded: Vec<Conditions>,
}

impl Verdicts {
    /// Appends the verdicts of the rows that follow.
    fn append(&mut self, next: Self) {
        self.verdicts.extend(next.verdicts);
        self.time_to_lift_off_s.extend(next.time_to_lift_off_s);
        self.recorded.extend(next.recorded);
        if let (Some(predictions), Some(next)) = (&mut self.predictions, next.predictions) {
            predictions.append(next);
        }
    }
}
