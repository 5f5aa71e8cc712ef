//! ROS 2 without a ROS installation: DDS (Data Distribution Service) topics with the names and types that ROS 2 gives
//! them. Messages stay bytes; their meaning is found elsewhere.

mod names;
mod participant;
mod payload;
mod subscribe;

pub use names::{dds_topic, dds_type, ros_topic, ros_type};
pub use participant::{Participant, RawWriter};
pub use subscribe::start_dds;
