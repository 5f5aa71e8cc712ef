//! States of another source, changed by what no filter follows: masses of payloads as logged, measured loads of supports.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use tipwatch_mechanics::State;

use super::state_source::{EstimatedStates, StateSource};

/// Changes the state of a row.
pub(crate) type Change = dyn Fn(usize, &mut State<f64>) + Send + Sync;

/// The states of another source, of which some are changed.
pub(super) struct ChangedStates {
    pub(super) source: Arc<dyn StateSource>,
    /// The rows that are, in order.
    pub(super) rows: Vec<Range<usize>>,
    pub(super) change: Arc<Change>,
    /// A state of the machine.
    pub(super) blank: State<f64>,
}

impl fmt::Debug for ChangedStates {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut of = formatter.debug_struct("ChangedStates");
        of.field("source", &self.source).field("rows", &self.rows);
        of.finish_non_exhaustive()
    }
}

impl StateSource for ChangedStates {
    fn rows_at_once(&self) -> usize {
        self.source.rows_at_once()
    }

    fn read(&self, rows: Range<usize>) -> EstimatedStates {
        let mut read = self.source.read(rows.clone());
        let mut state = self.blank.clone();
        for changed in &self.rows {
            for row in changed.start.max(rows.start)..changed.end.min(rows.end) {
                read.states.get(row - rows.start, &mut state);
                (self.change)(row, &mut state);
                read.states.set(row - rows.start, &mut state);
            }
        }
        read
    }

    fn state(&self, row: usize, state: &mut State<f64>) {
        self.source.state(row, state);
        if self.rows.iter().any(|rows| rows.contains(&row)) {
            (self.change)(row, state);
        }
    }

    fn failure(&self) -> Option<String> {
        self.source.failure()
    }
}
