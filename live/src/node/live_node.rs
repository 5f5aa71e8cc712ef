//! A process's access to the shared memory: the factory of all ports.

use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use iceoryx2::prelude::*;
use iceoryx2::service::attribute::AttributeVerifier;

use super::event::{EventListener, EventNotifier};
use super::iceoryx::{Service, cause};
use super::port::{Receiver, Sender};
use crate::system::signals::{self, Interrupted};
use crate::wire::topics::{LAYOUT_ATTRIBUTE, MAX_BORROWED, MAX_NODES, MAX_READERS, Topic};

/// How long a writer waits for the place of one that has died.
const DEAD_WRITER_LIMIT: Duration = Duration::from_secs(1);

/// Which services are meant.
#[derive(Debug, Clone)]
pub struct ServiceAddress {
    /// The name that all services share.
    pub service: String,
    /// What the names of all shared files begin with; `None` for the default of iceoryx2. Processes with
    /// different prefixes do not see each other.
    pub prefix: Option<String>,
}

/// A process that has joined the shared memory.
#[derive(Debug)]
pub struct LiveNode {
    node: Node<ipc::Service>,
    place: ServiceAddress,
}

impl LiveNode {
    /// Joins as `role`. SIGINT and SIGTERM are then told by [`signals`].
    ///
    /// # Errors
    /// The shared memory cannot be used, or the prefix is none.
    pub fn new(place: &ServiceAddress, role: &str) -> Result<Self> {
        set_log_level(LogLevel::Error);
        signals::listen();
        let mut config = Config::global_config().clone();
        if let Some(prefix) = &place.prefix {
            let name = FileName::new(prefix.as_bytes());
            config.global.prefix = name
                .map_err(cause)
                .with_context(|| format!("prefix \"{prefix}\""))?;
        }
        let name = NodeName::new(role).map_err(cause)?;
        let node = NodeBuilder::new()
            .config(&config)
            .name(&name)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>();
        Ok(Self {
            node: node
                .map_err(cause)
                .context("shared memory: cannot be joined")?,
            place: place.clone(),
        })
    }

    /// Removes what processes that ended without cleaning up have left; how many they were.
    pub fn remove_dead_nodes(&self) -> u64 {
        self.node.try_cleanup_dead_nodes().cleanups
    }

    /// A writer of messages of a kind, for this machine.
    ///
    /// # Errors
    /// There is another writer where there may be one only, or another version of this program.
    pub fn sender<T: Topic>(&self, source: u64, machine_hash: u64) -> Result<Sender<T>> {
        let start = Instant::now();
        loop {
            match Sender::new(self.service::<T>()?, source, machine_hash) {
                // a writer that was killed just now still counts until somebody removes it
                Err(_) if start.elapsed() < DEAD_WRITER_LIMIT => {
                    std::thread::sleep(DEAD_WRITER_LIMIT / 20);
                    self.remove_dead_nodes();
                }
                sender => return sender,
            }
        }
    }

    /// A reader of messages of a kind.
    ///
    /// # Errors
    /// There are too many readers, or another version of this program.
    pub fn receiver<T: Topic>(&self) -> Result<Receiver<T>> {
        Receiver::new(self.service::<T>()?)
    }

    /// Wakes whoever waits for messages of a kind.
    ///
    /// # Errors
    /// There are too many that do so.
    pub fn event_notifier<T: Topic>(&self) -> Result<EventNotifier> {
        EventNotifier::new(&self.node, &self.service_name::<T>())
    }

    /// Waits to be woken for messages of a kind.
    ///
    /// # Errors
    /// There are too many that do so.
    pub fn event_listener<T: Topic>(&self) -> Result<EventListener> {
        EventListener::new(&self.node, &self.service_name::<T>())
    }

    fn service_name<T: Topic>(&self) -> String {
        format!("{}{}", self.place.service, T::SUFFIX)
    }

    /// Opens or creates a service; all its settings are stated. It overwrites what is oldest: nobody
    /// ever waits for a reader.
    fn service<T: Topic>(&self) -> Result<Service<T>> {
        let name = self.service_name::<T>();
        let service = ServiceName::new(&name)
            .map_err(cause)
            .with_context(|| format!("service \"{name}\""))?;
        let layout = format!("{:016x}", T::LAYOUT);
        let key = LAYOUT_ATTRIBUTE.try_into().map_err(cause)?;
        let verifier =
            AttributeVerifier::new().require(&key, &layout.as_str().try_into().map_err(cause)?);
        self.node
            .service_builder(&service)
            .publish_subscribe::<T>()
            .enable_safe_overflow(true)
            .history_size(usize::from(T::IS_KEPT))
            .subscriber_max_buffer_size(T::QUEUE)
            .subscriber_max_borrowed_samples(MAX_BORROWED)
            .max_publishers(T::WRITERS)
            .max_subscribers(MAX_READERS)
            .max_nodes(MAX_NODES)
            .open_or_create_with_attributes(&verifier.map_err(cause)?)
            .map_err(cause)
            .with_context(|| format!("service \"{name}\": cannot be opened"))
    }
}

/// Waits.
///
/// # Errors
/// [`Interrupted`] if a signal to end has come.
pub fn pause(duration: Duration) -> Result<(), Interrupted> {
    if !duration.is_zero() {
        std::thread::sleep(duration);
    }
    signals::check()
}
