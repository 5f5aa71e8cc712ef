//! Errors of reading or writing a place.

use std::fmt;
use std::time::Duration;

use crate::redact::redact;

/// Reason why a place could not be read or written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The text is not a place.
    NotAPlace,
    /// There is no such object, bucket or file.
    NotFound,
    /// The credentials do not permit the request, or there are none.
    PermissionDenied,
    /// The object was replaced while it was read: what was read and what follows are not of one version.
    Changed,
    /// No answer in time, after all attempts.
    TimedOut,
    /// The server could not be reached or answered with an error, after all attempts.
    Unavailable,
    /// The server sent other bytes than requested, or the connection broke, after all attempts.
    Incomplete,
    /// The server does not serve parts of an object.
    NoRanges,
    /// Only the whole object can be read, which was not allowed.
    WholeRead,
    /// This kind of place does not support the operation.
    Unsupported,
    /// The local file system refused.
    Local(std::io::ErrorKind),
    /// The server refused for another reason.
    Refused,
}

/// An error with the place where it happened. Its text contains no credentials.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    /// The place, redacted.
    pub place: String,
    /// The kind of error.
    pub kind: ErrorKind,
    /// Found content or error, with the remedy.
    pub detail: String,
}

impl Error {
    pub(crate) fn new(
        place: impl Into<String>,
        kind: ErrorKind,
        detail: impl Into<String>,
    ) -> Self {
        Self {
            place: redact(&place.into()),
            kind,
            detail: redact(&detail.into()),
        }
    }

    pub(crate) fn local(place: impl Into<String>, error: &std::io::Error) -> Self {
        let kind = match error.kind() {
            std::io::ErrorKind::NotFound => ErrorKind::NotFound,
            std::io::ErrorKind::PermissionDenied => ErrorKind::PermissionDenied,
            kind => ErrorKind::Local(kind),
        };
        Self::new(place, kind, error.to_string())
    }

    pub(crate) fn timed_out(place: impl Into<String>, after: Duration) -> Self {
        let detail = format!(
            "no answer within {} s (TIPWATCH_STORAGE_TIMEOUT)",
            after.as_secs_f64()
        );
        Self::new(place, ErrorKind::TimedOut, detail)
    }
}

impl fmt::Display for ErrorKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::NotAPlace => "not a path or URL",
            Self::NotFound => "not found",
            Self::PermissionDenied => "permission denied",
            Self::Changed => "changed while it was read",
            Self::TimedOut => "timed out",
            Self::Unavailable => "not available",
            Self::Incomplete => "incomplete answer",
            Self::NoRanges => "parts cannot be read",
            Self::WholeRead => "no index",
            Self::Unsupported => "not supported",
            Self::Local(_) => "input/output error",
            Self::Refused => "refused",
        })
    }
}

impl fmt::Display for Error {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: {}", self.place, self.kind)?;
        match self.detail.is_empty() {
            true => Ok(()),
            false => write!(formatter, ": {}", self.detail),
        }
    }
}

impl std::error::Error for Error {}

impl From<Error> for std::io::Error {
    fn from(error: Error) -> Self {
        let kind = match error.kind {
            ErrorKind::NotFound => std::io::ErrorKind::NotFound,
            ErrorKind::PermissionDenied => std::io::ErrorKind::PermissionDenied,
            ErrorKind::TimedOut => std::io::ErrorKind::TimedOut,
            ErrorKind::Incomplete => std::io::ErrorKind::UnexpectedEof,
            ErrorKind::Local(kind) => kind,
            _ => std::io::ErrorKind::Other,
        };
        Self::new(kind, error)
    }
}
