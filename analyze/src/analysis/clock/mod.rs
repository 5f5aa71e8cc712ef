//! Whether the signals of a log belong to one time: offsets between topics, found from the physics.
//!
//! Two sensors often feel the same thing: odometry and IMU the same turning, wheels and odometry the same
//! travel, the IMU how the platform leans when the arm that the joint states tell moves its weight. The
//! delay at which they agree best is by how much the stamps of one are late. `estimate` finds it for every
//! such pair (`pairs` says which), with its standard deviation, or says why the log does not tell; and puts
//! the pairs together to one offset for each topic. Nothing is applied unless it is asked for.

mod channel;
mod delay;
mod evenly;
mod network;
mod offsets;
mod pairs;
pub mod words;

pub(crate) use network::estimate;
pub use offsets::{ClockOffsets, PairOffset, TopicOffset};
