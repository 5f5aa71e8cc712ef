//! The number type of the equations: `f64` for one sample, [`Lanes`] for four samples at once, dual numbers
//! for derivatives; and the normal distribution. One set of equations serves all of them.
//!
//! Operations are restricted to those that IEEE 754 defines exactly (add, subtract, multiply, divide,
//! square root, compare): no fused multiply-add, no platform `sin`. Every lane of a [`Lanes`] therefore
//! holds the same bits as a scalar `f64` evaluation.

#[macro_use]
mod from_operations;

mod atan2;
mod dual;
mod gradient;
mod jet;
mod lanes;
mod normal;
mod real;
mod scalar;
mod sin_cos;

pub use dual::Dual;
pub use gradient::Gradient;
pub use jet::Jet;
pub use lanes::{LaneMask, Lanes};
pub use normal::{BEYOND_SURE, SURE_SIGMAS, normal_density, normal_distribution};
pub use real::{Mask, Real, Wheels};
