//! Source of the states of a log's rows.

use std::fmt::Debug;
use std::ops::Range;

use tipwatch_mechanics::State;
use tipwatch_mechanics::estimation::EstimatedStates;

/// Source of the states of rows.
pub(crate) trait StateSource: Debug + Send + Sync {
    /// Rows that are best read at once, from a multiple of their number on.
    fn rows_at_once(&self) -> usize;

    /// The states of consecutive rows. They are unknown where they cannot be read.
    fn read(&self, rows: Range<usize>) -> EstimatedStates;

    /// Reads the state of a row.
    fn state(&self, row: usize, state: &mut State<f64>);

    /// Returns the error for which states could not be read so far, if any.
    fn failure(&self) -> Option<String>;
}
