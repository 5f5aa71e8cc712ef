//! Measured loads against computed ones: row by row, in bands, and where they contradict each other.

mod compare;
mod compared_row;
mod contradiction;
mod excess;
mod singles;
mod statistics;
mod total;
mod total_row;
mod unstated;

pub use compare::LoadComparison;
pub(crate) use compare::{Comparison, measures_supports, sampled_rows};
pub use compared_row::ComparedRow;
pub use contradiction::{Contradiction, TOTAL};
pub(crate) use statistics::EXPECTED;
pub use statistics::SensorStatistics;
pub use unstated::UnstatedLoad;
