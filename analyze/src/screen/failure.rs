//! Failures of logs: kinds that programs can tell apart without reading a text.

use std::path::Path;

use serde::{Deserialize, Serialize};
use strum::{Display, EnumString};
use tipwatch_language::word;
use tipwatch_storage::{ErrorKind, Location};

use crate::base::storage_error::storage_error;

/// Kind of a failure.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, Display, EnumString,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum FailureKind {
    /// The log cannot be read or analysed.
    Log,
    /// No machine, or more than one, is assigned to it.
    Machine,
    /// The storage did not deliver it: no answer, no permission, an error of the server, an object that is no longer there, a
    /// key that no request can name. Another run tries again.
    Storage,
    /// The log changed while it was being read.
    Changed,
    /// An error of the program.
    Internal,
    /// The process ended while the log was analysed.
    WorkerLost,
    /// The process was ended because it needed too much memory.
    OutOfMemory,
    /// The engine could not run the analysis.
    Engine,
    /// The log was asked for, and no process finished it; or the record of a log cannot be read.
    NoRecord,
}

impl FailureKind {
    /// Its name for people.
    pub(super) fn in_words(self) -> &'static str {
        match self {
            Self::Log => word!("log"),
            Self::Machine => word!("machine"),
            Self::Storage => word!("storage"),
            Self::Changed => word!("changed"),
            Self::Internal => word!("internal"),
            Self::WorkerLost => word!("worker lost"),
            Self::OutOfMemory => word!("out of memory"),
            Self::Engine => word!("engine"),
            Self::NoRecord => word!("no record"),
        }
    }

    /// The kind of an analysis's error.
    pub(super) fn of(error: &anyhow::Error) -> Self {
        if let Some(marked) = error.downcast_ref::<Marked>() {
            return marked.kind;
        }
        let Some(error) = storage_error(error) else {
            return Self::Log;
        };
        // what a bucket listed may be deleted before it is read
        let is_remote = Location::is_remote_path(Path::new(&error.place));
        match error.kind {
            ErrorKind::Changed => Self::Changed,
            ErrorKind::NotFound if is_remote => Self::Storage,
            ErrorKind::NotAPlace
            | ErrorKind::PermissionDenied
            | ErrorKind::TimedOut
            | ErrorKind::Unavailable
            | ErrorKind::Incomplete
            | ErrorKind::Refused => Self::Storage,
            _ => Self::Log,
        }
    }

    /// An error of this kind.
    pub(super) fn error(self, text: String) -> anyhow::Error {
        Marked { kind: self, text }.into()
    }
}

/// An error whose kind is not [`FailureKind::Log`].
#[derive(Debug)]
struct Marked {
    kind: FailureKind,
    text: String,
}

impl std::fmt::Display for Marked {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text)
    }
}

impl std::error::Error for Marked {}
