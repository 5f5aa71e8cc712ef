//! The checks that every message must pass before it is used, and the estimator behind them.
//!
//! ```text
//!     message -> admit -> AdmittedSample -> (estimator) -> assess -> AssessedSample -> complete_row -> Conditions
//! ```
//! Each step consumes the result of the step before, so that none can be left out or repeated.
//! [`CheckedEstimator`] is the one place that takes them all.
//!
//! Whether a sample is used depends on the messages alone, not on when they are read: two readers of a
//! session agree on every sample. Only freshness depends on the time of day.

mod checked_estimator;
mod checks;
mod delay;
mod sensor_watch;

pub use checked_estimator::{CheckedEstimator, CompletedRow, Step};
pub use checks::{Admitted, AdmittedSample, AssessedSample, Guard, Refused};
