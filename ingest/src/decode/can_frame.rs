//! CAN frames in messages of ROS.

use tipwatch_can::{CanId, Frame, FrameKind};

use super::{
    error::DecodeError,
    fields::Fields,
    layout::{Layout, layout_of},
};
use crate::{
    message::{BindingError, Topic},
    schema::normal_type_name,
};

/// Types of classical frames (ros_canopen, ros2_socketcan), and of frames that may be CAN FD.
const CLASSICAL: &str = "can_msgs/Frame";
const FD: &str = "ros2_socketcan_msgs/FdFrame";
const SEC: usize = 0;
const NANOSEC: usize = 1;
const ID: usize = 2;
const IS_EXTENDED: usize = 3;
const IS_ERROR: usize = 4;
const DATA: usize = 5;
const LENGTH: usize = 6;
const IS_REMOTE: usize = 7;

/// Whether messages of this type are CAN frames.
pub(crate) fn is_can_frame(type_name: &str) -> bool {
    let name = normal_type_name(type_name);
    name == CLASSICAL || name == FD
}

/// Reads frames from the messages of one topic.
#[derive(Debug, Clone)]
pub(crate) struct FrameDecoder {
    layout: Layout,
    fields: Fields,
    has_remote: bool,
}

/// Stamp of the header (s and ns), if it is set.
pub(crate) type Stamp = Option<(i32, u32)>;

impl FrameDecoder {
    /// Prepares decoding.
    pub(crate) fn new(topic: &Topic) -> Result<Self, BindingError> {
        let name = normal_type_name(&topic.type_name);
        if !is_can_frame(&name) {
            return Err(BindingError::WrongType {
                topic: topic.name.clone(),
                expected: "can_msgs/msg/Frame",
                found: topic.type_name.clone(),
            });
        }
        let has_remote = name == CLASSICAL;
        let (length, is_remote) = match has_remote {
            true => ("dlc", Some("is_rtr")),
            false => ("len", None),
        };
        let mut paths = vec![
            "header.stamp.sec",
            "header.stamp.nanosec",
            "id",
            "is_extended",
            "is_error",
            "data[]",
            length,
        ];
        paths.extend(is_remote);
        Ok(Self {
            layout: layout_of(topic, &paths)?,
            fields: Fields::new(),
            has_remote,
        })
    }

    /// Reads a frame, all but its time and channel. `None` if the message holds impossible numbers.
    pub(crate) fn decode(
        &mut self,
        message: &[u8],
        frame: &mut Frame,
    ) -> Result<Option<Stamp>, DecodeError> {
        self.layout.decode(message, &mut self.fields)?;
        let fields = &self.fields;
        let is_set = |path: usize| fields.number(path) > 0.0;
        // all are small integers, so that conversions are exact
        let raw = fields.number(ID) as u32;
        frame.id = match is_set(IS_EXTENDED) {
            true => CanId::extended(raw),
            false => CanId::standard(raw),
        };
        frame.kind = match (is_set(IS_ERROR), self.has_remote && is_set(IS_REMOTE)) {
            (true, _) => FrameKind::Error,
            (false, true) => FrameKind::Remote,
            (false, false) => FrameKind::Data,
        };
        let numbers = fields.numbers(DATA);
        let len = fields.number(LENGTH) as usize;
        let mut data = [0; tipwatch_can::MOST_DATA_BYTES];
        let (Some(target), Some(numbers)) = (data.get_mut(..len), numbers.get(..len)) else {
            return Ok(None);
        };
        for (byte, number) in target.iter_mut().zip(numbers) {
            *byte = *number as u8;
        }
        let is_remote = frame.kind == FrameKind::Remote;
        frame.set_data(if is_remote { &[] } else { target });
        frame.is_fd = !self.has_remote;
        let stamp = (fields.number(SEC) as i32, fields.number(NANOSEC) as u32);
        Ok(Some((stamp != (0, 0)).then_some(stamp)))
    }
}
