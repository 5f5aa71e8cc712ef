//! Derivatives of every wheel's load by every signal and parameter: exact, in one backward pass.
//!
//! The load's [`Influence`](crate::wheel_loads) says how it answers to the ground wrench and to the
//! wheels' places. What changes those is followed from there: the joints' and the base's motion
//! ([`motion`](self)), the links' inertial parameters in which the wrench is linear (the regressor),
//! and the places of wheels, arm and IMU.

mod chain;
mod derivatives;
mod geometry;
mod regressor;
mod sensed_motion;
mod sums;
mod writer;

pub(crate) use chain::followed_by;
pub use derivatives::Sensitivity;
pub(crate) use sensed_motion::SensedMotion;
pub(crate) use sums::LaneSums;
pub use sums::SensitivitySums;
