//! The ends of the two services: the only place that calls iceoryx2.

use std::fmt::Debug;
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use iceoryx2::node::NodeWaitFailure;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::port::{BackpressureAction, SendError};
use iceoryx2::prelude::PortFactory as _;
use iceoryx2::prelude::*;
use iceoryx2::service::attribute::AttributeVerifier;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use crate::topics::{
    LAYOUT_ATTRIBUTE, MAX_BORROWED, MAX_NODES, MAX_READERS, MAX_WRITERS, SAMPLE_QUEUE,
    SAMPLES_SUFFIX, SESSION_QUEUE, SESSION_SUFFIX, Wire, WireSample, WireSession,
};

type Service<T> = PortFactory<ipc::Service, T, ()>;

/// Which services are meant.
#[derive(Debug, Clone)]
pub struct Place {
    /// The name that both services share.
    pub service: String,
    /// What the names of all shared files begin with; `None` for the default of iceoryx2. Processes with
    /// different prefixes do not see each other.
    pub prefix: Option<String>,
}

/// The process was asked to end, by SIGINT or SIGTERM.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interrupted;

/// What became of a sample that was sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delivery {
    /// Every reader has it.
    ToAll,
    /// The queue of some reader is full.
    SomeQueueIsFull,
}

/// Both services, opened or created by whichever end comes first.
#[derive(Debug)]
struct Services {
    // The node last: it is dropped after the services that it opened.
    samples: Service<WireSample>,
    sessions: Service<WireSession>,
    node: Node<ipc::Service>,
}

impl Services {
    fn open(place: &Place, role: &str) -> Result<Self> {
        set_log_level(LogLevel::Error);
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
            .create::<ipc::Service>();
        let node = node
            .map_err(cause)
            .context("shared memory: cannot be joined")?;
        let samples = open(
            &node,
            &format!("{}{SAMPLES_SUFFIX}", place.service),
            SAMPLE_QUEUE,
            0,
        )?;
        let sessions = open(
            &node,
            &format!("{}{SESSION_SUFFIX}", place.service),
            SESSION_QUEUE,
            SESSION_QUEUE,
        )?;
        Ok(Self {
            samples,
            sessions,
            node,
        })
    }

    fn pause(&self, duration: Duration) -> Result<(), Interrupted> {
        let waited = match self.node.wait(duration) {
            // Any signal ends the sleep: this one was perhaps none to end the process.
            Err(NodeWaitFailure::Interrupt) => self.node.wait(Duration::ZERO),
            waited => waited,
        };
        waited.map_err(|_| Interrupted)
    }

    /// Removes what processes that ended without cleaning up have left in these services; how many.
    fn forget_the_dead(&self) -> u64 {
        self.node.try_cleanup_dead_nodes().cleanups
    }
}

/// Opens or creates a service; all its settings are stated.
fn open<T: Wire>(
    node: &Node<ipc::Service>,
    name: &str,
    queue: usize,
    history: usize,
) -> Result<Service<T>> {
    let service = ServiceName::new(name)
        .map_err(cause)
        .with_context(|| format!("service \"{name}\""))?;
    let layout = format!("{:016x}", T::LAYOUT);
    let key = LAYOUT_ATTRIBUTE.try_into().map_err(cause)?;
    let verifier =
        AttributeVerifier::new().require(&key, &layout.as_str().try_into().map_err(cause)?);
    node.service_builder(&service)
        .publish_subscribe::<T>()
        .enable_safe_overflow(history > 0)
        .history_size(history)
        .subscriber_max_buffer_size(queue)
        .subscriber_max_borrowed_samples(MAX_BORROWED)
        .max_publishers(MAX_WRITERS)
        .max_subscribers(MAX_READERS)
        .max_nodes(MAX_NODES)
        .open_or_create_with_attributes(&verifier.map_err(cause)?)
        .map_err(cause)
        .with_context(|| format!("service \"{name}\": cannot be opened"))
}

/// iceoryx2's errors are plain enumerations.
fn cause(error: impl Debug) -> anyhow::Error {
    anyhow!("iceoryx2: {error:?}")
}

/// The writing end.
#[derive(Debug)]
pub struct Writer {
    samples: Publisher<ipc::Service, WireSample, ()>,
    sessions: Publisher<ipc::Service, WireSession, ()>,
    services: Services,
}

impl Writer {
    /// Opens the services for writing.
    ///
    /// # Errors
    /// Another writer has them, or another version of this program.
    pub fn open(place: &Place) -> Result<Self> {
        let services = Services::open(place, "tipwatch-replay")?;
        // A full queue is reported, and what to do about it is the caller's business: iceoryx2 itself
        // would wait, for ever if the reader is dead.
        let samples = services
            .samples
            .publisher_builder()
            .set_backpressure_handler(|_| BackpressureAction::DiscardDataAndFail)
            .create();
        let samples = samples
            .map_err(cause)
            .context("samples: cannot be written; is another replay running?")?;
        // This service overwrites: it never waits.
        let sessions = services.sessions.publisher_builder().create();
        let sessions = sessions
            .map_err(cause)
            .context("session: cannot be written; is another replay running?")?;
        Ok(Self {
            samples,
            sessions,
            services,
        })
    }

    /// Announces a session to all readers, those included that come later.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn announce(&self, session: &WireSession) -> Result<()> {
        self.sessions
            .send_copy(*session)
            .map_err(cause)
            .context("session: cannot be sent")?;
        Ok(())
    }

    /// Gives new readers the session, and room for samples.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn greet(&self) -> Result<()> {
        self.sessions
            .update_connections()
            .map_err(cause)
            .context("session: cannot be sent")?;
        self.samples
            .update_connections()
            .map_err(cause)
            .context("samples: cannot be sent")
    }

    /// Sends a sample; never waits.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn send(&self, sample: &WireSample) -> Result<Delivery> {
        let loan = self
            .samples
            .loan_uninit()
            .map_err(cause)
            .context("samples: no memory")?;
        match loan.write_payload(*sample).send() {
            // iceoryx2 passes silently over a reader with a full queue that has not attached to it yet.
            Ok(recipients) if recipients < self.readers() => Ok(Delivery::SomeQueueIsFull),
            Ok(_) => Ok(Delivery::ToAll),
            Err(SendError::UnableToDeliver) => Ok(Delivery::SomeQueueIsFull),
            Err(error) => bail!(cause(error).context("samples: cannot be sent")),
        }
    }

    /// How many readers of samples there are, the dead included that were not forgotten yet.
    #[must_use]
    pub fn readers(&self) -> usize {
        self.services
            .samples
            .dynamic_config()
            .number_of_subscribers()
    }

    /// Forgets processes that died, so that they no longer count as readers; how many they were.
    pub fn forget_the_dead(&self) -> u64 {
        self.services.forget_the_dead()
    }

    /// Waits.
    ///
    /// # Errors
    /// [`Interrupted`] if a signal to end came.
    pub fn pause(&self, duration: Duration) -> Result<(), Interrupted> {
        self.services.pause(duration)
    }
}

/// The reading end.
#[derive(Debug)]
pub struct Reader {
    samples: Subscriber<ipc::Service, WireSample, ()>,
    sessions: Subscriber<ipc::Service, WireSession, ()>,
    services: Services,
}

impl Reader {
    /// Opens the services for reading.
    ///
    /// # Errors
    /// There are too many readers, or another version of this program has the services.
    pub fn open(place: &Place) -> Result<Self> {
        let services = Services::open(place, "tipwatch-monitor")?;
        // The session first: who sees a reader of samples may rely on it.
        let sessions = services
            .sessions
            .subscriber_builder()
            .buffer_size(SESSION_QUEUE)
            .create();
        let sessions = sessions.map_err(cause).context("session: cannot be read")?;
        let samples = services
            .samples
            .subscriber_builder()
            .buffer_size(SAMPLE_QUEUE)
            .create();
        let samples = samples.map_err(cause).context("samples: cannot be read")?;
        Ok(Self {
            samples,
            sessions,
            services,
        })
    }

    /// The session, if one was announced since the last call.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn session(&self) -> Result<Option<WireSession>> {
        let attached = self.samples.update_connections();
        attached.map_err(cause).context("samples: cannot be read")?;
        let received = self
            .sessions
            .receive()
            .map_err(cause)
            .context("session: cannot be read")?;
        Ok(received.map(|sample| *sample.payload()))
    }

    /// Lends the next sample to `take`; `None` if there is none.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn sample<R>(&self, take: impl FnOnce(&WireSample) -> R) -> Result<Option<R>> {
        let received = self
            .samples
            .receive()
            .map_err(cause)
            .context("samples: cannot be read")?;
        Ok(received.map(|sample| take(sample.payload())))
    }

    /// Whether there is a sample to read.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn has_samples(&self) -> Result<bool> {
        self.samples
            .has_samples()
            .map_err(cause)
            .context("samples: cannot be read")
    }

    /// Whether there is a writer of samples, the dead included that were not forgotten yet.
    #[must_use]
    pub fn has_writer(&self) -> bool {
        self.services
            .samples
            .dynamic_config()
            .number_of_publishers()
            > 0
    }

    /// Forgets processes that died, so that they no longer count as writers.
    pub fn forget_the_dead(&self) {
        self.services.forget_the_dead();
    }

    /// Waits.
    ///
    /// # Errors
    /// [`Interrupted`] if a signal to end came.
    pub fn pause(&self, duration: Duration) -> Result<(), Interrupted> {
        self.services.pause(duration)
    }
}
