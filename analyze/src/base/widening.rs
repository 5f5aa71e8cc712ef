//! Widening of computed rows in a table because motion between them was not observed.

use std::fmt::Debug;

use tipwatch_mechanics::machine::Machine;

use super::rows::Rows;

/// Widens the bands of consecutive rows.
pub(crate) trait Widening: Debug + Send + Sync {
    /// Widens them on `machine`, whose quantities they have; `next_ns` is the time of the row that follows them.
    fn widen(&self, machine: &Machine, rows: &mut Rows, next_ns: Option<i64>);

    /// Returns the error for which samples could not be read so far, if any.
    fn failure(&self) -> Option<String> {
        None
    }
}
