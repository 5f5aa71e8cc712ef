//! Offsets between the clocks of topics, estimated from the physics.
//!
//! Two sensors often measure the same motion. Odometry and IMU (inertial measurement unit) both measure
//! the rotation of the machine, wheels and odometry its speed. The IMU also measures the tilt of the
//! platform that follows from the arm positions in the joint states. The delay at which two measurements
//! agree best is the offset between their stamps.
//! `estimate` finds it for every such pair (`pairs` lists them) with its standard deviation, or explains
//! why the log does not determine it. Then it combines the pairs to one offset for each topic. Offsets
//! are applied only on request.

mod channel;
mod delay;
mod grid;
mod motion;
mod network;
mod offsets;
mod pairs;
mod scene;
pub mod text;
mod tilt;

pub(crate) use network::estimate;
pub use offsets::{ClockOffsets, PairOffset, TopicOffset};
pub(crate) use scene::activity;
