//! Stability measures besides the loads, for any support polygon.

mod balance;
mod edge_moments;
mod fill;
mod force_angle;
mod load_distribution;
mod values;
mod velocity_gradient;

pub(crate) use balance::Balance;
pub(crate) use edge_moments::overturning;
pub(crate) use fill::{arm_wrench_of, fill, fill_wrench_free};
pub use force_angle::TippingAngles;
pub use values::Indicators;
pub use velocity_gradient::VelocityGradient;
