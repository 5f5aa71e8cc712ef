//! The producing end of a session: announces it, sends its samples, wakes who waits for them.

use anyhow::Result;

use crate::node::{Joined, ReaderProgress, Sender, TopicNotifier};
use crate::topics::{WireProgress, WireSample, WireSession};

/// Writes one session.
#[derive(Debug)]
pub struct Producer {
    samples: Sender<WireSample>,
    sessions: Sender<WireSession>,
    topic_notifier: TopicNotifier,
    progress: ReaderProgress,
}

impl Producer {
    /// Opens the services for the session `source` of a machine.
    ///
    /// # Errors
    /// Another producer has them, or another version of this program.
    pub fn new(joined: &Joined, source: u64, machine_hash: u64) -> Result<Self> {
        Ok(Self {
            samples: joined.sender(source, machine_hash)?,
            sessions: joined.sender(source, machine_hash)?,
            topic_notifier: joined.topic_notifier::<WireSample>()?,
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
        self.topic_notifier.ring();
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
    pub fn greet(&self) -> Result<()> {
        self.sessions.greet()?;
        self.samples.greet()
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
