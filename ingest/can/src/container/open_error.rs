//! Errors of opening a file of frames.

use std::io;

/// Error: a file of frames cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The file is not a file of frames.
    #[error(
        "expected candump text, Vector ASC, Vector BLF, a PEAK PCAN trace or ASAM MF4, found \"{found}\""
    )]
    Unknown {
        /// Its first bytes.
        found: String,
    },
    /// Its structure is damaged, or it has no bus frames.
    #[error("{0}")]
    Invalid(String),
}
