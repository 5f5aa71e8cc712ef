//! Offsets between the clocks of topics, estimated from the physics.
//!
//! Two sensors often measure the same motion: odometry and IMU (inertial measurement unit) the turning,
//! wheels and odometry the travel, the IMU also the lean of the platform when the arm in the joint
//! states moves its weight. The delay at which they agree best is the offset between their stamps.
//! `estimate` finds it for every such pair (`pairs` lists them) with its standard deviation, or explains
//! why the log does not determine it. Then it combines the pairs to one offset for each topic. Offsets
//! are applied only on request.

mod channel;
mod delay;
mod grid;
mod leaning;
mod motion;
mod network;
mod offsets;
mod pairs;
mod scene;
pub mod words;

pub(crate) use network::estimate;
pub use offsets::{ClockOffsets, PairOffset, TopicOffset};
