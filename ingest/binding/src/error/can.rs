//! Errors of reading a CAN signal.

use std::io;
use std::path::PathBuf;

use tipwatch_can::DatabaseError;

/// Error: a CAN signal cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum CanError {
    /// The DBC file cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The file is not a DBC file.
    #[error("{}: {source}", path.display())]
    Dbc {
        /// The file.
        path: PathBuf,
        /// Error in the DBC file.
        source: DatabaseError,
    },
    /// The DBC file lacks a message.
    #[error("{}: expected the message {message}, found: {}", path.display(), available.join(", "))]
    NoMessage {
        /// The file.
        path: PathBuf,
        /// The message.
        message: String,
        /// Messages that the file has.
        available: Vec<String>,
    },
    /// A parameter group whose layout is not built in.
    #[error(
        "expected a parameter group whose layout is built in ({}), found {pgn}: name a DBC file and a message",
        known.iter().map(u32::to_string).collect::<Vec<_>>().join(", ")
    )]
    NoGroup {
        /// The parameter group number.
        pgn: u32,
        /// Parameter groups whose layout is built in.
        known: Vec<u32>,
    },
    /// A message lacks a signal.
    #[error("CAN message {message}: expected the signal {signal}, found: {}", available.join(", "))]
    NoSignal {
        /// The message.
        message: String,
        /// The signal.
        signal: String,
        /// Signals that the message has.
        available: Vec<String>,
    },
}
