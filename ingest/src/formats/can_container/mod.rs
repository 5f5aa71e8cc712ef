//! Files of CAN loggers: each channel is a topic of frames, in the message types that ROS has for them.

mod encode;
mod reader;

pub use self::encode::CanFrameType;
pub(crate) use self::reader::CanReader;
