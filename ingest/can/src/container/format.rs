//! File formats of CAN traces, recognised by the first bytes.

use super::text::UTF8_MARK;

/// The format of a file of frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContainerFormat {
    /// Text of candump (can-utils), as a file (`-l`) or as printed.
    Candump,
    /// Vector ASC.
    Asc,
    /// Vector BLF.
    Blf,
    /// PEAK PCAN trace.
    Trc,
    /// ASAM MDF version 4 with bus logging.
    Mf4,
}

impl ContainerFormat {
    /// The format that the beginning of a file shows; a few kilobytes suffice.
    #[must_use]
    pub fn of(beginning: &[u8]) -> Option<Self> {
        if beginning.starts_with(b"LOGG") {
            return Some(Self::Blf);
        }
        if beginning.starts_with(b"MDF     ") || beginning.starts_with(b"UnFinMF ") {
            return Some(Self::Mf4);
        }
        let beginning = beginning.strip_prefix(UTF8_MARK).unwrap_or(beginning);
        // a line that the end of the bytes cuts is judged as well
        let lines = beginning.split(|&byte| byte == b'\n').take(64);
        let lines = lines
            .map(<[u8]>::trim_ascii)
            .filter(|line| !line.is_empty());
        for line in lines {
            if super::candump::is_line(line) {
                return Some(Self::Candump);
            }
            if super::asc::is_header(line) || super::asc::is_frame(line) {
                return Some(Self::Asc);
            }
            if super::trc::is_line(line) {
                return Some(Self::Trc);
            }
        }
        None
    }
}
