//! Measured loads against computed ones: one row at a time, and, by the rows so far, whether they contradict each other.
//!
//! [`compare`] judges a row, whoever asks: the analysis of a whole log, or a [`LoadWatch`], which knows past rows only, live and to
//! reproduce a live run offline. Measured loads change no computed one here.

mod compare;
mod rows;
mod run;
mod singles;
mod total;
mod total_row;
mod unstated;
mod watch;

pub use compare::{compare, measures_supports};
pub use rows::{ComparedRow, MeasuredRow, RowPlace, shows};
pub(super) use run::Run;
pub use run::{FEWEST_ROWS, LEAST_NS};
pub use singles::{Acts, PointForce};
pub use total::{exchanged, sensors_of_all};
pub use total_row::TotalRow;
pub use unstated::UnstatedLoad;
pub(super) use watch::PERIOD_NS;
pub use watch::{LoadDoubt, LoadWatch};
