//! Waits of a loop for the next message.

use std::str::FromStr;
use std::time::Duration;

use anyhow::Result;

use super::event::EventListener;
use super::live_node::LiveNode;
use crate::safety_limits::MAX_WAIT;
use crate::wire::topics::Topic;

/// Options of a loop that follows sessions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LoopOptions {
    /// Way to wait for samples.
    pub wake: Wake,
    /// Whether the program waits for the next session when one is over.
    pub stays: bool,
}

/// Way to wait for the next message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wake {
    /// Not at all. Fastest, but occupies a whole processor core.
    Poll,
    /// Until the writer notifies the loop, but no longer than [`MAX_WAIT`] or two ticks of the kernel's clock.
    #[default]
    Event,
    /// For this long.
    Sleep(Duration),
}

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
    Event(Box<EventListener>),
    /// See [`Wake::Sleep`].
    Sleep(Duration),
}

impl Waiter {
    /// A waiter for messages of this type.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn new<T: Topic>(node: &LiveNode, wake: Wake) -> Result<Self> {
        Ok(match wake {
            Wake::Poll => Self::Poll,
            Wake::Event => Self::Event(Box::new(node.event_listener::<T>()?)),
            Wake::Sleep(time) => Self::Sleep(time),
        })
    }

    /// Waits once.
    pub fn wait(&self) {
        match self {
            Self::Poll => std::hint::spin_loop(),
            Self::Event(listener) => listener.wait(MAX_WAIT),
            Self::Sleep(time) => std::thread::sleep(*time),
        }
    }
}
