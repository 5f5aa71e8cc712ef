//! Measured loads against computed ones: one row at a time, and, by the rows so far, whether they contradict each other.
//!
//! [`compare`] judges a row, whoever asks: the analysis of a whole log, or a [`LoadWatch`], which knows past rows only, live and to
//! reproduce a live run offline. Measured loads change no computed one here.

mod compare;
mod compared_row;
mod excess;
mod measured_row;
mod run;
mod singles;
mod total;
mod total_row;
mod unstated;
mod watch;

pub use compare::{compare, measures_supports};
pub use compared_row::ComparedRow;
pub use excess::shows;
pub use measured_row::{MeasuredRow, RowPlace};
pub use run::{FEWEST_ROWS, LEAST_NS};
pub use singles::{Acts, PointForce};
pub use total::{exchanged, sensors_of_all};
pub use total_row::TotalRow;
pub use unstated::UnstatedLoad;
pub use watch::{LoadDoubt, LoadWatch};
