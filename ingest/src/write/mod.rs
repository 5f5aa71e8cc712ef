//! Writes MCAP files: new logs, recovered ones, and clips of logs.

mod clips;
mod recover;
mod ros2_writer;

pub use self::{
    clips::{ClipReport, ClipRequest, write_clips},
    recover::{RecoverError, RecoveryReport, recover, recover_with},
    ros2_writer::{Ros2Writer, WriteError, WriterTopic},
};
