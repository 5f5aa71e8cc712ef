//! The producer of a session: announces it, sends its samples and wakes their readers.

use anyhow::Result;

use super::event::EventNotifier;
use super::live_node::LiveNode;
use super::port::Sender;
use super::reader_progress::ReaderProgress;
use crate::wire::topics::{WireProgress, WireSample, WireSession};

/// Publishes one session.
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
    /// Another producer uses them, or another version of this program.
    pub fn new(node: &LiveNode, source: u64, machine_hash: u64) -> Result<Self> {
        Ok(Self {
            samples: node.sender(source, machine_hash)?,
            sessions: node.sender(source, machine_hash)?,
            topic_notifier: node.event_notifier::<WireSample>()?,
            progress: ReaderProgress::new(node.receiver::<WireProgress>()?, source),
        })
    }

    /// Announces the session to all readers, including later ones.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn announce(&mut self, session: &mut WireSession) -> Result<()> {
        self.sessions.send(session).map(|_| ())
    }

    /// Sends a sample. It never waits.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn send(&mut self, sample: &mut WireSample) -> Result<()> {
        self.samples.send(sample)?;
        self.topic_notifier.notify();
        Ok(())
    }

    /// The writer of samples, for fault injection.
    pub fn samples(&mut self) -> &mut Sender<WireSample> {
        &mut self.samples
    }

    /// Connects new readers and delivers the session to them.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn update_connections(&self) -> Result<()> {
        self.sessions.update_connections()?;
        self.samples.update_connections()
    }

    /// Number of readers of samples, including dead ones that were not removed yet.
    #[must_use]
    pub fn readers(&self) -> usize {
        self.samples.readers()
    }

    /// Returns the number of samples that the slowest reader lags behind; `None` if a reader has not reported yet.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn backlog(&mut self) -> Result<Option<u64>> {
        self.backlog_of(self.samples.sequence())
    }

    /// Returns the same as [`Self::backlog`] for a producer that numbers its samples itself; `sent` is the number of samples
    /// sent.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn backlog_of(&mut self, sent: u64) -> Result<Option<u64>> {
        self.progress.update(sent)?;
        let slowest = self.progress.slowest(&self.samples, sent);
        Ok(slowest.map(|next| sent.saturating_sub(next)))
    }

    /// Returns the number of readers that have taken all samples; some of them may be gone since.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn read_by(&mut self) -> Result<usize> {
        let sent = self.samples.sequence();
        self.progress.update(sent)?;
        Ok(self.progress.that_reached(sent))
    }
}
