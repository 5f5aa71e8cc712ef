//! A process's access to the shared memory: the factory of all ports.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use iceoryx2::prelude::PortFactory as _;
use iceoryx2::prelude::*;
use iceoryx2::service::Service as _;
use iceoryx2::service::attribute::AttributeVerifier;
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeOpenError, PublishSubscribeOpenOrCreateError,
};

use super::event::{EventListener, EventNotifier};
use super::iceoryx::{Service, cause, opened};
use super::leftovers::{SHARED_MEMORY, remove_leftovers, remove_unsized, wait_for_sizes};
use super::other_user::explained;
use super::port::{Receiver, Sender};
use super::room::{PORT_BYTES, of_writer, require, reserve};
use crate::system::signals::{self, Interrupted};
use crate::wire::topics::{
    LAYOUT_ATTRIBUTE, MAX_BORROWED, MAX_NODES, MAX_READERS, ONE_WRITER, RESERVED_READERS,
    SAFE_OVERFLOW, Topic,
};

/// Longest wait of a writer for the slot of one that has died.
const DEAD_WRITER_LIMIT: Duration = Duration::from_secs(1);

/// Longest wait of a program for the place that is kept for it, where readers that are not of Tipwatch hold all places.
const NO_PLACE_LIMIT: Duration = Duration::from_secs(5);
/// Consecutive refusals of a reader though a place is free, after which the refusal has another cause.
const TRIES_THOUGH_FREE: u32 = 5;

/// Roles for which the last places of readers are kept.
const RESERVED_ROLES: [&str; RESERVED_READERS] = [
    "tipwatch-monitor",
    "tipwatch-control",
    "tipwatch-record",
    "tipwatch-acknowledge",
];

/// Names of the services.
#[derive(Debug, Clone)]
pub struct ServiceAddress {
    /// Common first part of all service names.
    pub service: String,
    /// Prefix of all files in shared memory; `None` for iceoryx2's default. Processes with different prefixes
    /// do not see each other.
    pub prefix: Option<String>,
}

/// A process that has joined the shared memory.
#[derive(Debug)]
pub struct LiveNode {
    node: Node<ipc::Service>,
    address: ServiceAddress,
    /// Whether the last places of readers are kept for this process.
    has_place: bool,
}

impl LiveNode {
    /// Joins under the name `role`. From then on [`signals`] reports SIGINT and SIGTERM.
    ///
    /// # Errors
    /// The shared memory cannot be used or is full, or the prefix is invalid.
    pub fn new(address: &ServiceAddress, role: &str) -> Result<Self> {
        signals::listen();
        Self::in_foreign_program(address, role)
    }

    /// As [`Self::new`], for a library: what SIGINT and SIGTERM do is the program's affair.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn in_foreign_program(address: &ServiceAddress, role: &str) -> Result<Self> {
        set_log_level(LogLevel::Error);
        let mut config = Config::global_config().clone();
        if let Some(prefix) = &address.prefix {
            let name = FileName::new(prefix.as_bytes());
            config.global.prefix = name
                .map_err(cause)
                .with_context(|| format!("prefix \"{prefix}\""))?;
        }
        require(Path::new(SHARED_MEMORY), PORT_BYTES)?;
        wait_for_sizes(&config);
        let name = NodeName::new(role).map_err(cause)?;
        let node = NodeBuilder::new()
            .config(&config)
            .name(&name)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>();
        let node = Self {
            node: node
                .map_err(|error| explained(cause(error), &config))
                .context("cannot join the shared memory")?,
            address: address.clone(),
            has_place: RESERVED_ROLES.contains(&role),
        };
        node.remove_dead_nodes();
        Ok(node)
    }

    /// Removes the nodes of processes that died without cleaning up; returns their number.
    pub fn remove_dead_nodes(&self) -> u64 {
        if !remove_unsized(self.node.config()) {
            return 0;
        }
        let found = self.node.try_cleanup_dead_nodes();
        if found.cleanups + found.failed_cleanups > 0 {
            remove_leftovers(self.node.config());
        }
        found.cleanups
    }

    /// A writer of messages of this type, for this machine.
    ///
    /// # Errors
    /// Another process writes a service that allows one writer, or uses another version of the messages, or there is no room
    /// for them ([`NoRoom`](super::NoRoom)).
    pub fn sender<T: Topic>(&self, source: u64, machine_hash: u64) -> Result<Sender<T>> {
        let memory = Path::new(SHARED_MEMORY);
        require(memory, of_writer::<T>())?;
        // a service of which nobody holds anything is removed, and made anew beside all others that want it
        let _kept = self.service::<T>()?;
        if T::WRITERS > ONE_WRITER && !self.has_place {
            let writers = self.writers::<T>()?;
            let free = T::WRITERS - RESERVED_READERS;
            ensure!(
                writers < free,
                "service \"{}\": expected fewer than {free} writers, found {writers}; the last {RESERVED_READERS} places are kept for \
                 monitor, control, recorder and acknowledgement",
                self.service_name::<T>()
            );
        }
        let start = Instant::now();
        let sender = loop {
            match Sender::new(self.service::<T>()?, source, machine_hash) {
                // a writer that was just killed counts until its node is removed
                Err(_) if start.elapsed() < DEAD_WRITER_LIMIT => {
                    std::thread::sleep(DEAD_WRITER_LIMIT / 20);
                    self.remove_dead_nodes();
                }
                sender => break sender?,
            }
        };
        let prefix = self.node.config().global.prefix.to_string();
        reserve(memory, &prefix, sender.id(), of_writer::<T>())?;
        Ok(sender)
    }

    /// Returns a sender, as [`Self::sender`]; `None`, which is told, for a program whose place is kept, where writers that are
    /// not of Tipwatch hold all places.
    ///
    /// # Errors
    /// As of [`Self::sender`].
    pub(super) fn sender_if_free<T: Topic>(&self) -> Result<Option<Sender<T>>> {
        match self.sender(0, 0) {
            Err(error) if self.has_place && self.writers::<T>()? >= T::WRITERS => {
                eprintln!(
                    "{error:#}; all {} places are taken: a replay that waits for its readers waits for this one in vain",
                    T::WRITERS
                );
                Ok(None)
            }
            sender => sender.map(Some),
        }
    }

    fn writers<T: Topic>(&self) -> Result<usize> {
        let service = self.service::<T>()?;
        Ok(service.dynamic_config().number_of_publishers())
    }

    /// A reader of messages of this type.
    ///
    /// # Errors
    /// There are too many readers, or another process uses another version of the messages, or there is no room.
    pub fn receiver<T: Topic>(&self) -> Result<Receiver<T>> {
        require(Path::new(SHARED_MEMORY), PORT_BYTES)?;
        let service = self.service::<T>()?;
        let (readers, free) = (
            service.dynamic_config().number_of_subscribers(),
            MAX_READERS - RESERVED_READERS,
        );
        ensure!(
            self.has_place || readers < free,
            "service \"{}\": expected fewer than {free} readers, found {readers}; the last {RESERVED_READERS} places are kept for \
             monitor, control, recorder and acknowledgement",
            self.service_name::<T>()
        );
        let start = Instant::now();
        let mut refused_though_free = 0;
        loop {
            match Receiver::new(self.service::<T>()?) {
                Err(error) if self.has_place => {
                    if !self.is_full::<T>()? {
                        // the last place was taken, and has become free since
                        refused_though_free += 1;
                        if refused_though_free > TRIES_THOUGH_FREE {
                            return Err(error);
                        }
                    } else if start.elapsed() >= NO_PLACE_LIMIT {
                        bail!(
                            "service \"{}\": expected a free place for a reader, found all {MAX_READERS} taken for {} s, by {}: end \
                             readers that are not needed",
                            self.service_name::<T>(),
                            NO_PLACE_LIMIT.as_secs(),
                            self.readers_of::<T>()?
                        );
                    }
                    // a reader that was just killed counts until its node is removed, and others may be about to end
                    pause(NO_PLACE_LIMIT / 50)
                        .ok()
                        .context("stopped by a signal")?;
                    self.remove_dead_nodes();
                }
                receiver => return receiver,
            }
        }
    }

    fn is_full<T: Topic>(&self) -> Result<bool> {
        let service = self.service::<T>()?;
        Ok(service.dynamic_config().number_of_subscribers() >= MAX_READERS)
    }

    /// The processes that read messages of this type, and how many readers each has, as text.
    fn readers_of<T: Topic>(&self) -> Result<String> {
        let mut processes: BTreeMap<i64, usize> = BTreeMap::new();
        self.service::<T>()?
            .dynamic_config()
            .list_subscribers(|it| {
                let process = it.node_id.pid::<ipc::Service>();
                let process = process.map_or(0, |process| i64::from(process.value()));
                *processes.entry(process).or_default() += 1;
                CallbackProgression::Continue
            });
        let told = processes.iter().map(|(process, readers)| {
            let name = std::fs::read_to_string(format!("/proc/{process}/comm"));
            let name = name.unwrap_or_else(|_| "a process that is no more".into());
            format!("{} (process {process}: {readers})", name.trim())
        });
        Ok(told.collect::<Vec<_>>().join(", "))
    }

    /// A notifier for messages of this type.
    ///
    /// # Errors
    /// There are too many notifiers.
    pub fn event_notifier<T: Topic>(&self) -> Result<EventNotifier> {
        const { assert!(T::HAS_EVENTS) };
        EventNotifier::new(&self.node, &self.service_name::<T>())
    }

    /// A listener for messages of this type.
    ///
    /// # Errors
    /// There are too many listeners.
    pub fn event_listener<T: Topic>(&self) -> Result<EventListener> {
        const { assert!(T::HAS_EVENTS) };
        EventListener::new(&self.node, &self.service_name::<T>(), self.has_place)
    }

    /// As [`Self::event_notifier`], for any type; `None` if its messages have no events.
    ///
    /// # Errors
    /// There are too many notifiers.
    pub fn event_notifier_of_any<T: Topic>(&self) -> Result<Option<EventNotifier>> {
        let new = || EventNotifier::new(&self.node, &self.service_name::<T>());
        T::HAS_EVENTS.then(new).transpose()
    }

    /// As [`Self::event_listener`], for any type; `None` if its messages have no events.
    ///
    /// # Errors
    /// There are too many listeners.
    pub fn event_listener_of_any<T: Topic>(&self) -> Result<Option<EventListener>> {
        let new = || EventListener::new(&self.node, &self.service_name::<T>(), self.has_place);
        T::HAS_EVENTS.then(new).transpose()
    }

    /// The first parts of the names of all services that carry messages of this type, of any address of this prefix.
    pub(super) fn services_with<T: Topic>(&self) -> Result<Vec<String>> {
        let mut names = Vec::new();
        let listed = ipc::Service::list(self.node.config(), |service| {
            let name = service.static_details.name().as_str();
            names.extend(name.strip_suffix(T::SUFFIX).map(str::to_owned));
            CallbackProgression::Continue
        });
        listed.map_err(cause)?;
        // each has one for messages and one for events
        names.sort();
        names.dedup();
        Ok(names)
    }

    fn service_name<T: Topic>(&self) -> String {
        format!("{}{}", self.address.service, T::SUFFIX)
    }

    /// Opens or creates a service with all its settings.
    fn service<T: Topic>(&self) -> Result<Service<T>> {
        let name = self.service_name::<T>();
        let service = ServiceName::new(&name)
            .map_err(cause)
            .with_context(|| format!("service \"{name}\""))?;
        let layout = format!("{:016x}", T::LAYOUT);
        let key = LAYOUT_ATTRIBUTE.try_into().map_err(cause)?;
        let verifier =
            AttributeVerifier::new().require(&key, &layout.as_str().try_into().map_err(cause)?);
        let verifier = verifier.map_err(cause)?;
        let open = || {
            self.node
                .service_builder(&service)
                .publish_subscribe::<T>()
                .enable_safe_overflow(SAFE_OVERFLOW)
                .history_size(T::HISTORY)
                .subscriber_max_buffer_size(T::QUEUE)
                .subscriber_max_borrowed_samples(MAX_BORROWED)
                .max_publishers(T::WRITERS)
                .max_subscribers(MAX_READERS)
                .max_nodes(MAX_NODES)
                .open_or_create_with_attributes(&verifier)
        };
        let is_in_flux = |error: &_| {
            use PublishSubscribeOpenOrCreateError::{
                PublishSubscribeOpenError as Open, SystemInFlux,
            };
            matches!(
                error,
                SystemInFlux | Open(PublishSubscribeOpenError::HangsInCreation)
            )
        };
        opened(open, is_in_flux)
            .map_err(|error| explained(cause(error), self.node.config()))
            .with_context(|| format!("service \"{name}\": cannot open it"))
    }
}

/// Sleeps.
///
/// # Errors
/// [`Interrupted`] if SIGINT or SIGTERM has arrived.
pub fn pause(duration: Duration) -> Result<(), Interrupted> {
    if !duration.is_zero() {
        std::thread::sleep(duration);
    }
    signals::check()
}
