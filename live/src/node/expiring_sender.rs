//! Sends messages that consumers may act on for a limited time only.

use anyhow::Result;

use super::event::EventNotifier;
use super::live_node::LiveNode;
use super::port::Sender;
use crate::safety_limits::VALIDITY_NS;
use crate::system::clock::Clock;
use crate::wire::topics::Expiring;

/// Sets the validity of each message, sends it and wakes its readers.
#[derive(Debug)]
pub struct ExpiringSender<'a, T: Expiring> {
    clock: &'a dyn Clock,
    sender: Sender<T>,
    notifier: EventNotifier,
    failure: Option<anyhow::Error>,
}

impl<'a, T: Expiring> ExpiringSender<'a, T> {
    /// A sender for this source.
    ///
    /// # Errors
    /// Another program sends these messages, or another version of this one has the service.
    pub fn new(
        node: &LiveNode,
        source: u64,
        machine_hash: u64,
        clock: &'a dyn Clock,
    ) -> Result<Self> {
        Ok(Self {
            clock,
            sender: node.sender(source, machine_hash)?,
            notifier: node.event_notifier::<T>()?,
            failure: None,
        })
    }

    /// The current time (ns).
    #[must_use]
    pub fn now_ns(&self) -> i64 {
        self.clock.now_ns()
    }

    /// Source and sequence number of the next message.
    #[must_use]
    pub fn next(&self) -> (u64, u64) {
        (self.sender.source(), self.sender.sequence())
    }

    /// Sends a message and returns its publication time (ns). It may be called in the middle of a row, so
    /// an error waits for [`Self::check`].
    pub fn send(&mut self, message: &mut T) -> i64 {
        let now_ns = self.clock.now_ns();
        message.set_valid_until(now_ns.saturating_add(VALIDITY_NS));
        match self.sender.send_at(message, now_ns) {
            Ok(_) => self.notifier.notify(),
            Err(error) => {
                self.failure.get_or_insert(error);
            }
        }
        now_ns
    }

    /// Checks that every message since the last check was sent.
    ///
    /// # Errors
    /// The shared memory has failed.
    pub fn check(&mut self) -> Result<()> {
        self.failure.take().map_or(Ok(()), Err)
    }
}
