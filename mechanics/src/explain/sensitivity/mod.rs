//! Exact derivatives of every wheel's load with respect to every signal and parameter, in one reverse pass.
//!
//! The adjoint of a load ([`LoadAdjoint`](crate::wheel_loads)) holds its derivatives with respect to the ground
//! wrench and the wheel positions. The reverse pass continues to what these depend on: the motion of joints and
//! base ([`motion`](self)), the inertial parameters of the links, in which the wrench is linear (the
//! regressor), and the positions of wheels, arm and IMU.

mod carried;
mod derivatives;
mod following;
mod geometry;
mod imu_joints;
mod place_matrix;
mod regressor;
mod reverse_pass;
mod sensed_motion;
mod sums;
mod wanted;
mod writer;

pub(crate) use derivatives::GroupDerivatives;
pub use derivatives::Sensitivity;
pub(crate) use following::followed_by;
pub(crate) use sensed_motion::SensedMotion;
pub use sums::SensitivitySums;
pub(crate) use sums::SquareSums;
