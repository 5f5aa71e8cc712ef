//! Failure of a call: a number for programs, a text for people.

use tipwatch_live::node::NoRoom;

/// `enum tipwatch_client_failure` of the header. -1 is that of the header's own functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub(crate) enum Kind {
    /// An argument is null, or no text in UTF-8.
    Argument = -2,
    /// There is no such service, or it has no events.
    Service = -3,
    /// The size is not that of the service's message.
    Size = -4,
    /// The client was opened by another thread, or before a fork.
    Thread = -5,
    /// There is no room in the shared memory.
    Room = -6,
    /// The shared memory fails.
    SharedMemory = -7,
    /// The library has a mistake.
    Mistake = -8,
    /// The client is closed, or was never open.
    Closed = -9,
}

/// Failure of a call.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) kind: Kind,
    /// Text for people: what was expected, and what was found.
    pub(crate) text: String,
}

impl Failure {
    pub(crate) fn new(kind: Kind, text: impl Into<String>) -> Self {
        Self {
            kind,
            text: text.into(),
        }
    }
}

impl From<anyhow::Error> for Failure {
    fn from(error: anyhow::Error) -> Self {
        let is_full = error.is::<NoRoom>();
        let kind = if is_full {
            Kind::Room
        } else {
            Kind::SharedMemory
        };
        Self::new(kind, format!("{error:#}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn want_of_room_has_a_number_of_its_own() {
        let full = NoRoom {
            folder: "/dev/shm".into(),
            needed: 2,
            free: 1,
        };
        let told = anyhow::Error::from(full).context("service").context("open");
        assert_eq!(Failure::from(told).kind, Kind::Room);
        let other = anyhow::anyhow!("files").context("open");
        assert_eq!(Failure::from(other).kind, Kind::SharedMemory);
    }
}
