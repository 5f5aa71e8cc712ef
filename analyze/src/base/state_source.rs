//! Where the states of a log's rows come from, and some of them.

use std::fmt::Debug;
use std::ops::Range;

use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::{State, StateColumns};

/// Where the states of rows come from.
pub(crate) trait StateSource: Debug + Send + Sync {
    /// Rows that are best read at once, from a multiple of their number on.
    fn rows_at_once(&self) -> usize;

    /// The states of consecutive rows. They are unknown where they cannot be read.
    fn read(&self, rows: Range<usize>) -> EstimatedStates;

    /// Reads the state of a row.
    fn state(&self, row: usize, state: &mut State<f64>);

    /// Why states could not be read so far.
    fn failure(&self) -> Option<String>;
}

/// The states of consecutive rows.
#[derive(Debug)]
pub(crate) struct EstimatedStates {
    pub(crate) states: StateColumns,
    /// Why rows are not valid, as far as the signals show.
    pub(crate) reasons: Vec<Reasons>,
}

impl EstimatedStates {
    /// Some of the rows.
    pub(crate) fn part(&self, rows: Range<usize>) -> Self {
        Self {
            states: self.states.block(rows.clone()),
            reasons: self.reasons[rows].to_vec(),
        }
    }
}
