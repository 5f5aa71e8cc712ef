//! The number the equations are written in: `f64` for one sample, [`Lanes`] for four samples side by
//! side, dual numbers for derivatives. One set of equations serves them all.
//!
//! The operations are those of IEEE 754 (add, subtract, multiply, divide, square root, compare) and
//! nothing else: no fused multiply-add, no platform `sin`. So every lane of a [`Lanes`] holds the
//! same bits as the `f64` computed alone.

mod atan2;
mod dual;
mod gradient;
mod jet;
mod lanes;
mod real;
mod scalar;
mod sin_cos;

pub use dual::Dual;
pub use gradient::Gradient;
pub use jet::Jet;
pub use lanes::{LaneMask, Lanes};
pub use real::{Mask, Real};
