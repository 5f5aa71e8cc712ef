//! Measured loads against computed ones: row by row, in bands, and where they contradict each other.

mod compare;
mod contradiction;
mod statistics;

pub use compare::LoadComparison;
pub(crate) use compare::{Comparison, sampled_rows};
pub use contradiction::{Contradiction, TOTAL};
pub(crate) use statistics::EXPECTED;
pub use statistics::SensorStatistics;
