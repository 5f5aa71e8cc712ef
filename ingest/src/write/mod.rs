//! Writes MCAP files: new logs, and recovered ones.

mod recover;
mod ros2_writer;

pub use self::{
    recover::{RecoverError, RecoveryReport, recover},
    ros2_writer::{Ros2Writer, WriteError, WriterTopic},
};
