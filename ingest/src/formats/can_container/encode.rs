//! Frames as messages of ROS 2.

use tipwatch_can::{Frame, FrameKind};

use crate::schema::{CDR, builtin};

/// Stamp of zero, and the empty name of a frame of reference with its end; then the padding of an integer.
const HEADER: [u8; 16] = [0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];

/// The message type of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CanFrameType {
    /// `can_msgs/Frame`, with up to eight bytes of data.
    Classical,
    /// `ros2_socketcan_msgs/FdFrame`, for a channel with CAN FD frames.
    Fd,
}

impl CanFrameType {
    /// Name of the type.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Classical => "can_msgs/msg/Frame",
            Self::Fd => "ros2_socketcan_msgs/msg/FdFrame",
        }
    }

    /// Its definition.
    #[must_use]
    pub fn definition(self) -> String {
        builtin::definition(self.name(), crate::schema::Dialect::Ros2).unwrap_or_default()
    }

    /// Writes a frame as a message; `false` if the type has no place for it: a remote frame on a channel with CAN FD.
    pub fn encode(self, frame: &Frame, message: &mut Vec<u8>) -> bool {
        let data = frame.data();
        let is_remote = frame.kind == FrameKind::Remote;
        let is_error = u8::from(frame.kind == FrameKind::Error);
        let is_extended = u8::from(frame.id.is_extended);
        // a frame has at most 64 bytes
        let len = data.len() as u8;
        message.clear();
        message.extend_from_slice(&CDR);
        message.extend_from_slice(&HEADER);
        message.extend_from_slice(&frame.id.raw.to_le_bytes());
        match self {
            Self::Classical => {
                let Some(rest) = 8_usize.checked_sub(data.len()) else {
                    return false;
                };
                message.extend_from_slice(&[u8::from(is_remote), is_extended, is_error, len]);
                message.extend_from_slice(data);
                message.extend_from_slice([0; 8].get(..rest).unwrap_or_default());
            }
            Self::Fd if is_remote => return false,
            Self::Fd => {
                message.extend_from_slice(&[is_extended, is_error, len, 0]);
                message.extend_from_slice(&u32::from(len).to_le_bytes());
                message.extend_from_slice(data);
            }
        }
        true
    }
}
