//! The producing end of a session: announces it, sends its samples, wakes who waits for them.

use anyhow::Result;

use super::event::EventNotifier;
use super::live_node::LiveNode;
use super::port::Sender;
use super::reader_progress::ReaderProgress;
use crate::wire::topics::{WireProgress, WireSample, WireSession};

/// Writes one session.
#[derive(Debug)]
pub struct Producer {
    samples: Sender<WireSample>,
    sessions: Sender<WireSession>,
    topic_notifier: EventNotifier,
    progress: ReaderProgress,
}

impl Producer {
    /// Opens the services for the session `source` of a machine.
    ///
    /// # Errors
    /// Another producer has them, or another version of this program.
    pub fn new(joined: &LiveNode, source: u64, machine_hash: u64) -> Result<Self> {
        Ok(Self {
            samples: joined.sender(source, machine_hash)?,
            sessions: joined.sender(source, machine_hash)?,
            topic_notifier: joined.event_notifier::<WireSample>()?,
            progress: ReaderProgress::new(joined.receiver::<WireProgress>()?, source),
        })
    }

    /// Announces the session to all readers, those included that come later.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn announce(&mut self, session: &mut WireSession) -> Result<()> {
        self.sessions.send(session).map(|_| ())
    }

    /// Sends a sample; never waits.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn send(&mut self, sample: &mut WireSample) -> Result<()> {
        self.samples.send(sample)?;
        self.topic_notifier.notify();
        Ok(())
    }

    /// The end of samples, for injecting faults.
    pub fn samples(&mut self) -> &mut Sender<WireSample> {
        &mut self.samples
    }

    /// Gives readers that have come since the session, and a place among the readers of samples.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn update_connections(&self) -> Result<()> {
        self.sessions.update_connections()?;
        self.samples.update_connections()
    }

    /// How many readers of samples there are, the dead included that were not forgotten yet.
    #[must_use]
    pub fn readers(&self) -> usize {
        self.samples.readers()
    }

    /// How many samples the slowest reader is behind; `None` where one has not told yet.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn backlog(&mut self) -> Result<Option<u64>> {
        let sent = self.samples.sequence();
        self.progress.update(sent)?;
        let slowest = self.progress.slowest(&self.samples, sent);
        Ok(slowest.map(|next| sent.saturating_sub(next)))
    }
}
