//! How a reader waits for the next message.

use std::str::FromStr;
use std::time::Duration;

use anyhow::Result;

use crate::node::{Ear, Joined};
use crate::topics::Topic;

/// How to wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wake {
    /// Not at all: looks again at once. The fastest, and it takes a whole processor.
    Poll,
    /// Until whoever writes wakes it, and no longer than a millisecond or two ticks of the kernel's clock.
    #[default]
    Event,
    /// For this long.
    Sleep(Duration),
}

/// Nobody has to wake a reader that waits for events: it looks so often anyway, as far as the kernel's clock
/// allows.
const LONGEST: Duration = Duration::from_millis(1);

impl FromStr for Wake {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "poll" => Ok(Self::Poll),
            "event" => Ok(Self::Event),
            _ => match text.parse() {
                Ok(us @ 1..=10_000) => Ok(Self::Sleep(Duration::from_micros(us))),
                _ => Err("expected \"poll\", \"event\" or microseconds from 1 to 10000".into()),
            },
        }
    }
}

/// Waits.
#[derive(Debug)]
pub enum Waiter {
    /// See [`Wake::Poll`].
    Poll,
    /// See [`Wake::Event`].
    Event(Box<Ear>),
    /// See [`Wake::Sleep`].
    Sleep(Duration),
}

impl Waiter {
    /// Waits for messages of a kind.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn new<T: Topic>(joined: &Joined, wake: Wake) -> Result<Self> {
        Ok(match wake {
            Wake::Poll => Self::Poll,
            Wake::Event => Self::Event(Box::new(joined.ear::<T>()?)),
            Wake::Sleep(time) => Self::Sleep(time),
        })
    }

    /// Waits once.
    pub fn wait(&self) {
        match self {
            Self::Poll => std::hint::spin_loop(),
            Self::Event(ear) => ear.wait(LONGEST),
            Self::Sleep(time) => std::thread::sleep(*time),
        }
    }
}
