//! Notes to the reader about a machine or a result, each with its kind.

use std::borrow::Borrow;
use std::fmt;
use std::ops::Deref;

use serde::{Serialize, Serializer};

/// Kind of a note. Programs decide by the kind, never by the words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoteKind {
    /// An assumption, a substitute, an anomaly.
    Remark,
    /// A value that was guessed, or stands in for a signal, and that nobody has confirmed.
    Unconfirmed,
    /// Sources that place the inertial measurement unit (IMU) differently.
    ImuMountingConflict,
    /// Signals that no motion of the log has tested.
    Untested,
    /// An input contradicts the machine file: results hold only if the machine file is right.
    InputFault,
}

/// A plain sentence or several, and its kind. It is written as its text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Note {
    /// Its kind.
    pub kind: NoteKind,
    text: String,
}

impl Note {
    /// A note of a kind.
    #[must_use]
    pub fn new(kind: NoteKind, text: String) -> Self {
        Self { kind, text }
    }
}

impl From<String> for Note {
    /// A remark.
    fn from(text: String) -> Self {
        Self::new(NoteKind::Remark, text)
    }
}

impl From<&str> for Note {
    /// A remark.
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

impl Deref for Note {
    type Target = str;

    fn deref(&self) -> &str {
        &self.text
    }
}

impl Borrow<str> for Note {
    fn borrow(&self) -> &str {
        self
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self)
    }
}

impl Serialize for Note {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self)
    }
}
