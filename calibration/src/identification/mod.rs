//! Identification: which masses, centres of mass, positions and sensor errors a machine has, by what was measured.
//!
//! Measured loads, actuator forces and specific forces are compared with those that the model of
//! [`tipwatch_mechanics`] computes. The parameters are the most probable ones under the stated uncertainty of the
//! machine file, which is the prior:
//! ```text
//!     minimise  (p - p0)' P0^-1 (p - p0) + sum over instants w_i r_i' R_i^-1 r_i
//! ```
//! The residuals r come from the mechanics' own equations and the derivatives from its adjoint. [`Data`] holds what was
//! measured, [`identify`] returns an [`Identification`]: changes, their joint covariance, what the data cannot tell,
//! and the error on data that was held back.

mod bands;
mod data;
mod directions;
mod fit;
mod held_back;
mod identify;
mod jacobian;
mod model;
mod noise;
mod posterior;
mod prior;
mod redundancy;

pub use bands::BandCheck;
pub use data::{Channel, Data, Instant, Measured, Reading, Situation, Source};
pub use directions::{Combination, Term};
pub use fit::SourceUse;
pub use identify::{
    ChannelError, Estimate, HeldBack, Identification, Knowledge, NothingToIdentify, identify,
};
pub use model::{predict, predicted};
pub use redundancy::{Agreement, Disagreement, agreement, calculated_sums};
