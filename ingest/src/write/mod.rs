//! Writes MCAP files: new logs, and recovered ones.

mod recover;
mod ros2_writer;

pub use self::{
    recover::{RecoverError, RecoveryReport, recover},
    ros2_writer::{OutTopic, Ros2Writer, WriteError},
};
