//! Estimation of states from sensor samples: everything that depends on earlier or later samples.
//!
//! Samples of different sensors arrive at different rates, late, twice or not at all. The channels that a
//! sensor measures together share one Kalman filter with a constant-acceleration model driven by white
//! jerk. Run forwards, sample by sample, it is the causal estimator ([`CausalEstimator`]), identical
//! offline and live. With a backward pass over the stored steps it is the Rauch-Tung-Striebel smoother
//! of the same model ([`smooth`], [`BlockSmoother`]), which uses later samples too. The stated noise is corrected by what
//! the samples so far show.
//!
//! No value is extrapolated over a gap longer than
//! [`EstimatorSpec::max_gap`](crate::machine::EstimatorSpec): rows in it are marked invalid.

mod adaptation;
mod alone;
mod bias;
mod causal;
mod faster;
mod filled_velocities;
mod followed;
mod held;
mod held_values;
mod history;
mod judged;
mod kalman_filter;
mod lag;
mod misfit;
#[cfg(test)]
mod noise_of_tests;
mod obedience;
mod onset;
pub mod plausibility;
pub mod quasi_static;
mod reading;
pub mod rotation;
mod rows;
mod shaken;
mod shown_noise;
mod smoother;
mod sorted_stamps;
mod state_builder;
pub mod support_configuration;
mod turns;
mod white_jerk;

pub use causal::CausalEstimator;
pub use filled_velocities::FilledVelocities;
pub use held_values::{HeldValues, Together};
pub(crate) use kalman_filter::{Doubt, FilterModel, KalmanFilter};
pub use rows::{Estimate, EstimatedStates, RowClock};
pub use shown_noise::ShownNoise;
pub use smoother::{
    BlockSmoother, BlockWorker, Pass, ROWS_PER_BLOCK, SampleSource, SensorSamples, SmoothedRows,
    smooth, visit_by_stamp,
};
pub use sorted_stamps::sorted_stamps;
