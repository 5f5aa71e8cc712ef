//! From sensor samples to states: everything that remembers time.
//!
//! Samples of different sensors come at different rates, late, twice or not at all. Each group of
//! channels that a sensor measures together is a track with a constant-second-derivative model
//! driven by white noise. Forward in time that is a Kalman filter, sample by sample, the same offline
//! and live ([`CausalEstimator`]); with a backward pass over the stored filter it is the
//! Rauch-Tung-Striebel smoother of the same model ([`smooth`]), which also looks ahead.
//!
//! No value is carried over a gap longer than [`EstimatorSpec::max_gap`](crate::machine::EstimatorSpec):
//! rows in it are invalid and say so.

mod assembly;
mod causal;
pub mod plausibility;
mod rows;
mod smoother;
mod track;

pub use causal::CausalEstimator;
pub use rows::{Estimate, RowClock};
pub use smoother::{SensorSamples, SmoothedRows, smooth};
pub(crate) use track::{Doubt, Model, Track};
