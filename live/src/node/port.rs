//! Writer and reader of a service.

use anyhow::{Context, Result};
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::PortFactory as _;
use iceoryx2::prelude::*;

use super::iceoryx::{Service, cause};
use crate::system::clock::monotonic_ns;
use crate::wire::topics::{Head, Topic};

/// Seals messages with head and checksum and sends them. It never waits.
#[derive(Debug)]
pub struct Sender<T: Topic> {
    // the port stands before its service, because fields are dropped in this order
    publisher: Publisher<ipc::Service, T, ()>,
    service: Service<T>,
    source: u64,
    machine_hash: u64,
    sequence: u64,
}

impl<T: Topic> Sender<T> {
    pub(super) fn new(service: Service<T>, source: u64, machine_hash: u64) -> Result<Self> {
        let publisher = service.publisher_builder().create();
        let publisher = publisher.map_err(cause).with_context(|| {
            format!(
                "{}: cannot write; is the same program already running?",
                T::TYPE_NAME
            )
        })?;
        Ok(Self {
            publisher,
            service,
            source,
            machine_hash,
            sequence: 0,
        })
    }

    /// The source in the head of its messages.
    #[must_use]
    pub fn source(&self) -> u64 {
        self.source
    }

    /// Sequence number of the next message.
    #[must_use]
    pub fn sequence(&self) -> u64 {
        self.sequence
    }

    /// The identity of this writer.
    #[must_use]
    pub fn id(&self) -> u128 {
        self.publisher.id().value()
    }

    /// Skips a sequence number, as if a message had been lost.
    pub fn skip(&mut self) {
        self.sequence += 1;
    }

    /// Seals and sends a message whose `time_ns` is set; returns its publication time (ns).
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn send(&mut self, message: &mut T) -> Result<i64> {
        self.send_at(message, monotonic_ns())
    }

    /// As [`Self::send`], with this publication time (ns).
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn send_at(&mut self, message: &mut T, published_ns: i64) -> Result<i64> {
        message.seal(Head {
            sequence: self.sequence,
            source: self.source,
            machine_hash: self.machine_hash,
            time_ns: message.head().time_ns,
            published_ns,
        });
        self.sequence += 1;
        self.send_raw(message)?;
        Ok(published_ns)
    }

    /// As [`Self::send`], with this source.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn send_as(&mut self, source: u64, message: &mut T) -> Result<()> {
        self.source = source;
        self.send(message).map(|_| ())
    }

    /// As [`Self::send`], for this machine.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn send_for(&mut self, machine_hash: u64, message: &mut T) -> Result<()> {
        self.machine_hash = machine_hash;
        self.send(message).map(|_| ())
    }

    /// Sends a message unchanged.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn send_raw(&self, message: &T) -> Result<()> {
        let loan = self.publisher.loan_uninit().map_err(cause);
        let loan = loan.with_context(|| format!("{}: out of shared memory", T::TYPE_NAME))?;
        let sent = loan.write_payload(*message).send().map_err(cause);
        sent.with_context(|| format!("{}: cannot send", T::TYPE_NAME))?;
        Ok(())
    }

    /// Connects new readers, and delivers the message that is kept for late joiners.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn update_connections(&self) -> Result<()> {
        let updated = self.publisher.update_connections().map_err(cause);
        updated.with_context(|| format!("{}: cannot send", T::TYPE_NAME))
    }

    /// Number of readers, including dead ones that were not removed yet.
    #[must_use]
    pub fn readers(&self) -> usize {
        // the library counts one already before it can be found, and so be waited for
        let mut count = 0;
        self.each_reader(|_| count += 1);
        count
    }

    /// Calls `each` with the identity of every reader.
    pub fn each_reader(&self, mut each: impl FnMut(u128)) {
        self.service.dynamic_config().list_subscribers(|details| {
            each(details.subscriber_id.value());
            CallbackProgression::Continue
        });
    }
}

/// Reads messages.
#[derive(Debug)]
pub struct Receiver<T: Topic> {
    subscriber: Subscriber<ipc::Service, T, ()>,
    service: Service<T>,
}

impl<T: Topic> Receiver<T> {
    pub(super) fn new(service: Service<T>) -> Result<Self> {
        let subscriber = service.subscriber_builder().buffer_size(T::QUEUE).create();
        let subscriber = subscriber.map_err(cause);
        Ok(Self {
            subscriber: subscriber.with_context(|| format!("{}: cannot read", T::TYPE_NAME))?,
            service,
        })
    }

    /// Passes the next message to `take`; `None` if none waits.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn receive<R>(&self, take: impl FnOnce(&T) -> R) -> Result<Option<R>> {
        let received = self.subscriber.receive().map_err(cause);
        let received = received.with_context(|| format!("{}: cannot read", T::TYPE_NAME))?;
        Ok(received.map(|message| take(message.payload())))
    }

    /// Passes all messages that wait to `take`.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn receive_all(&self, mut take: impl FnMut(&T)) -> Result<()> {
        while self.receive(&mut take)?.is_some() {}
        Ok(())
    }

    /// Connects to new writers.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn update_connections(&self) -> Result<()> {
        let updated = self.subscriber.update_connections().map_err(cause);
        updated.with_context(|| format!("{}: cannot read", T::TYPE_NAME))
    }

    /// Number of writers, including dead ones that were not removed yet.
    #[must_use]
    pub fn writers(&self) -> usize {
        self.service.dynamic_config().number_of_publishers()
    }

    /// The identity of this reader.
    #[must_use]
    pub fn id(&self) -> u128 {
        self.subscriber.id().value()
    }
}
