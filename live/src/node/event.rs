//! Notifications: one process wakes another.

use std::time::Duration;

use anyhow::{Context, Result, ensure};
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::{Notifier, NotifierCreateError};
use iceoryx2::prelude::PortFactory as _;
use iceoryx2::prelude::*;
use iceoryx2::service::builder::event::{EventOpenError, EventOpenOrCreateError};
use iceoryx2::service::port_factory::event::PortFactory;

use super::iceoryx::{cause, opened};
use crate::wire::topics::{MAX_NODES, MAX_READERS, RESERVED_READERS};

type Events = PortFactory<ipc::Service>;

fn events(node: &Node<ipc::Service>, name: &str) -> Result<Events> {
    let service = ServiceName::new(name)
        .map_err(cause)
        .with_context(|| format!("service \"{name}\""))?;
    let open = || {
        node.service_builder(&service)
            .event()
            .max_listeners(MAX_READERS)
            .max_notifiers(MAX_READERS)
            .max_nodes(MAX_NODES)
            .open_or_create()
    };
    let is_in_flux = |error: &_| {
        use EventOpenOrCreateError::{EventOpenError as Open, SystemInFlux};
        matches!(error, SystemInFlux | Open(EventOpenError::HangsInCreation))
    };
    opened(open, is_in_flux)
        .map_err(cause)
        .with_context(|| format!("events \"{name}\": cannot open it"))
}

/// Wakes the listeners of a service.
#[derive(Debug)]
pub struct EventNotifier {
    /// `None` where others hold all places.
    notifier: Option<Notifier<ipc::Service>>,
    events: Events,
}

impl EventNotifier {
    pub(super) fn new(node: &Node<ipc::Service>, name: &str) -> Result<Self> {
        let events = events(node, name)?;
        let notifier = match events.notifier_builder().create() {
            Err(NotifierCreateError::ExceedsMaxSupportedNotifiers) => {
                eprintln!(
                    "events \"{name}\": all {MAX_READERS} places of notifiers are taken: readers are not woken, and look by themselves"
                );
                None
            }
            notifier => Some(notifier.map_err(cause)?),
        };
        Ok(Self { notifier, events })
    }

    /// Wakes all listeners; almost free if there are none. A listener that misses it wakes up by itself after
    /// [`MAX_WAIT`](crate::safety_limits::MAX_WAIT).
    pub fn notify(&self) {
        if let Some(notifier) = &self.notifier
            && self.events.dynamic_config().number_of_listeners() > 0
        {
            let _ = notifier.notify();
        }
    }
}

/// Waits for notifications of a service.
#[derive(Debug)]
pub struct EventListener {
    listener: Listener<ipc::Service>,
    _events: Events,
}

impl EventListener {
    /// `has_place`: the last places are kept for it.
    pub(super) fn new(node: &Node<ipc::Service>, name: &str, has_place: bool) -> Result<Self> {
        let events = events(node, name)?;
        let listeners = events.dynamic_config().number_of_listeners();
        let free = MAX_READERS - RESERVED_READERS;
        ensure!(
            has_place || listeners < free,
            "events \"{name}\": expected fewer than {free} listeners, found {listeners}; the last {RESERVED_READERS} places are \
             kept for monitor, control, recorder and acknowledgement"
        );
        let listener = events.listener_builder().create().map_err(cause)?;
        Ok(Self {
            listener,
            _events: events,
        })
    }

    /// Waits for a notification, but no longer than this.
    pub fn wait(&self, longest: Duration) {
        // a signal ends the wait too: the caller checks for everything anyway
        let _ = self.listener.timed_wait(|_| {}, longest);
    }
}
