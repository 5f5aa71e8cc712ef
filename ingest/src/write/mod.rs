//! Writes MCAP files: new logs, and recovered ones.

mod recover;
mod ros2_writer;

pub use self::{
    recover::{RecoverError, RecoveryReport, recover, recover_with},
    ros2_writer::{Ros2Writer, WriteError, WriterTopic},
};
