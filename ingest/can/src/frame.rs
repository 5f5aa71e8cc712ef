//! A frame as it was on the bus, and where frames come from.

use std::io;

/// The most bytes of data in a frame (CAN FD).
pub const MOST_DATA_BYTES: usize = 64;

/// Identifier of a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CanId {
    /// The 11 or 29 bits.
    pub raw: u32,
    /// Whether the identifier has 29 bits.
    pub is_extended: bool,
}

impl CanId {
    /// An identifier of 11 bits; further bits are cut off.
    #[must_use]
    pub fn standard(raw: u32) -> Self {
        Self {
            raw: raw & 0x7ff,
            is_extended: false,
        }
    }

    /// An identifier of 29 bits; further bits are cut off.
    #[must_use]
    pub fn extended(raw: u32) -> Self {
        Self {
            raw: raw & 0x1fff_ffff,
            is_extended: true,
        }
    }
}

/// Kind of a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum FrameKind {
    /// A frame with data.
    #[default]
    Data,
    /// A request for data.
    Remote,
    /// The controller reports an error on the bus.
    Error,
}

/// A frame of CAN or CAN FD.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// Time of reception (ns), on the clock of the logger.
    pub time_ns: i64,
    /// Index of the channel among those of its source.
    pub channel: usize,
    /// Its identifier.
    pub id: CanId,
    /// Kind of the frame.
    pub kind: FrameKind,
    /// Whether the frame is one of CAN FD.
    pub is_fd: bool,
    data: [u8; MOST_DATA_BYTES],
    len: u8,
}

impl Default for Frame {
    fn default() -> Self {
        Self {
            time_ns: 0,
            channel: 0,
            id: CanId::default(),
            kind: FrameKind::Data,
            is_fd: false,
            data: [0; MOST_DATA_BYTES],
            len: 0,
        }
    }
}

impl Frame {
    /// The data.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        self.data.get(..usize::from(self.len)).unwrap_or_default()
    }

    /// Makes the frame an error frame, which has neither identifier nor data.
    pub(crate) fn set_error(&mut self) {
        self.id = CanId::default();
        self.kind = FrameKind::Error;
        self.len = 0;
    }

    /// Sets the data; `false`, and nothing is changed, for more than [`MOST_DATA_BYTES`].
    pub fn set_data(&mut self, data: &[u8]) -> bool {
        let Some(target) = self.data.get_mut(..data.len()) else {
            return false;
        };
        target.copy_from_slice(data);
        self.len = data.len() as u8;
        true
    }
}

/// Source of frames: a file, a socket, a pipe.
pub trait FrameSource {
    /// Reads the next intact frame; `false` at the end.
    ///
    /// # Errors
    /// The source cannot be read.
    fn next_frame(&mut self, frame: &mut Frame) -> io::Result<bool>;

    /// Names of the channels met so far, such as `can0`; [`Frame::channel`] is an index of them.
    fn channels(&self) -> &[String];
}

/// Returns the number of bytes for a data length code of CAN FD.
pub(crate) fn fd_length(dlc: u8) -> usize {
    const LENGTHS: [usize; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];
    LENGTHS[usize::from(dlc & 15)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_longer_than_a_frame_is_refused() {
        let mut frame = Frame::default();
        assert!(frame.set_data(&[1, 2]));
        assert!(!frame.set_data(&[0; 65]));
        assert_eq!(frame.data(), [1, 2]);
    }
}
