//! One service, for messages that come and go as bytes. Its ends are opened when they are first used.

use std::time::Duration;

use tipwatch_live::node::{EventListener, EventNotifier, LiveNode, Receiver, Sender};
use tipwatch_live::wire::topics::Topic;

use crate::failure::{Failure, Kind};

/// A service, whatever its messages are.
pub(crate) trait Service {
    /// Suffix of its name.
    fn suffix(&self) -> &'static str;

    /// Opens the end that writes, and that which notifies.
    fn open_writer(&mut self, node: &LiveNode) -> Result<(), Failure>;

    /// Sends a message.
    fn send(&mut self, node: &LiveNode, message: &[u8]) -> Result<(), Failure>;

    /// Notifies who waits for messages.
    fn notify(&mut self, node: &LiveNode) -> Result<(), Failure>;

    /// Passes the next message of this size to `take`; false if none waits.
    fn receive(
        &mut self,
        node: &LiveNode,
        size: usize,
        take: &mut dyn FnMut(&[u8]),
    ) -> Result<bool, Failure>;

    /// Waits for a notification, but no longer than this.
    fn wait(&mut self, node: &LiveNode, longest: Duration) -> Result<(), Failure>;

    /// Delivers the message that is kept for late joiners to those who have joined since.
    fn deliver_history(&self) -> Result<(), Failure>;
}

/// The ends of a service that are open.
pub(crate) struct Ends<T: Topic> {
    sender: Option<Sender<T>>,
    notifier: Option<EventNotifier>,
    receiver: Option<Receiver<T>>,
    listener: Option<EventListener>,
}

impl<T: Topic> Ends<T> {
    pub(crate) fn closed() -> Self {
        Self {
            sender: None,
            notifier: None,
            receiver: None,
            listener: None,
        }
    }

    fn writer(&mut self, node: &LiveNode) -> Result<&Sender<T>, Failure> {
        if T::HAS_EVENTS {
            opened(&mut self.notifier, || notifier::<T>(node))?;
        }
        // messages are sealed before they come here: source and machine stand in them
        opened(&mut self.sender, || Ok(node.sender(0, 0)?))
    }
}

impl<T: Topic> Service for Ends<T> {
    fn suffix(&self) -> &'static str {
        T::SUFFIX
    }

    fn open_writer(&mut self, node: &LiveNode) -> Result<(), Failure> {
        self.writer(node).map(|_| ())
    }

    fn send(&mut self, node: &LiveNode, message: &[u8]) -> Result<(), Failure> {
        let message = T::of_bytes(message).ok_or_else(|| wrong_size::<T>(message.len()))?;
        Ok(self.writer(node)?.send_raw(&message)?)
    }

    fn notify(&mut self, node: &LiveNode) -> Result<(), Failure> {
        opened(&mut self.notifier, || notifier::<T>(node))?.notify();
        Ok(())
    }

    fn receive(
        &mut self,
        node: &LiveNode,
        size: usize,
        take: &mut dyn FnMut(&[u8]),
    ) -> Result<bool, Failure> {
        if size != size_of::<T>() {
            return Err(wrong_size::<T>(size));
        }
        let receiver = opened(&mut self.receiver, || Ok(node.receiver()?))?;
        let received = receiver.receive(|message: &T| take(message.bytes()))?;
        Ok(received.is_some())
    }

    fn wait(&mut self, node: &LiveNode, longest: Duration) -> Result<(), Failure> {
        let listener = opened(&mut self.listener, || listener::<T>(node))?;
        // nothing that arrives meanwhile is missed
        opened(&mut self.receiver, || Ok(node.receiver::<T>()?))?;
        if !longest.is_zero() {
            listener.wait(longest);
        }
        Ok(())
    }

    fn deliver_history(&self) -> Result<(), Failure> {
        match &self.sender {
            Some(sender) if T::HISTORY > 0 => Ok(sender.update_connections()?),
            _ => Ok(()),
        }
    }
}

/// An end, opened if it is not open yet.
fn opened<E>(
    end: &mut Option<E>,
    open: impl FnOnce() -> Result<E, Failure>,
) -> Result<&E, Failure> {
    let found = match end.take() {
        Some(found) => found,
        None => open()?,
    };
    Ok(end.insert(found))
}

fn notifier<T: Topic>(node: &LiveNode) -> Result<EventNotifier, Failure> {
    node.event_notifier_of_any::<T>()?
        .ok_or_else(no_events::<T>)
}

fn listener<T: Topic>(node: &LiveNode) -> Result<EventListener, Failure> {
    node.event_listener_of_any::<T>()?
        .ok_or_else(no_events::<T>)
}

fn no_events<T: Topic>() -> Failure {
    Failure::new(
        Kind::Service,
        format!(
            "service \"{}\": expected one with events, found none",
            T::SUFFIX
        ),
    )
}

fn wrong_size<T: Topic>(found: usize) -> Failure {
    Failure::new(
        Kind::Size,
        format!(
            "service \"{}\": expected messages of {} bytes, found {found}",
            T::SUFFIX,
            size_of::<T>()
        ),
    )
}
