//! Follows one session at a time: the part that monitor, control and recorder share.

use std::collections::VecDeque;

use anyhow::Result;

use super::live_node::LiveNode;
use super::sample_reader::SampleReader;
use crate::wire::session::Progress;
use crate::wire::topics::{Wire, WireSample, WireSession};

/// A program that follows sessions.
pub trait SessionHost {
    /// State that the program keeps of the session that it follows.
    type Session;

    /// The identity of a session.
    fn id(session: &Self::Session) -> u64;

    /// Prepares to follow an announced session, after the one that is followed until now.
    ///
    /// # Errors
    /// It is a session of another machine, or cannot be followed.
    fn begin(
        &mut self,
        announced: &WireSession,
        before: Option<&Self::Session>,
    ) -> Result<Self::Session>;

    /// Replaces one session by the next.
    ///
    /// # Errors
    /// Ends the program.
    fn succeed(&mut self, next: &mut Self::Session, before: Self::Session) -> Result<()>;

    /// A session was announced that cannot be followed, and none is running.
    ///
    /// # Errors
    /// Ends the program.
    fn refuse(&mut self, error: anyhow::Error) -> Result<()> {
        Err(error)
    }

    /// A session was announced that cannot be followed; the one before goes on.
    fn reject(&mut self, running: &mut Self::Session, error: &anyhow::Error);

    /// Takes a sample.
    ///
    /// # Errors
    /// Ends the program.
    fn take(&mut self, session: &mut Self::Session, sample: &WireSample) -> Result<Progress>;
}

/// Announced sessions that are remembered: samples of so many may still wait.
const REMEMBERED: usize = 8;

/// Reads samples, and follows the session that they belong to.
#[derive(Debug)]
pub struct SessionFollower<S> {
    reader: SampleReader,
    has_lost_producer: bool,
    /// The last sessions that were announced, followed or not, and the number of samples of others while none was followed.
    announced: VecDeque<u64>,
    unannounced: u64,
    /// The session that is followed.
    pub active: Option<S>,
}

impl<S> SessionFollower<S> {
    /// Opens the services for reading. Producers take a reader of samples as a sign that the whole program
    /// is ready: open everything else first.
    ///
    /// # Errors
    /// There are too many readers, or another version of this program has the services.
    pub fn new(node: &LiveNode) -> Result<Self> {
        Ok(Self {
            reader: SampleReader::new(node)?,
            has_lost_producer: false,
            announced: VecDeque::with_capacity(REMEMBERED),
            unannounced: 0,
            active: None,
        })
    }

    /// Number of samples of sessions that nobody announced, while none was followed.
    #[must_use]
    pub fn unannounced(&self) -> u64 {
        self.unannounced
    }

    /// Whether the session that is followed has lost its producer: when a sample was last asked for, none waited and no producer
    /// was left. The producer was killed, or it sent the end of the session before this reader joined. Dead producers count as
    /// present until they are removed.
    #[must_use]
    pub fn has_lost_producer(&self) -> bool {
        self.has_lost_producer && self.active.is_some()
    }

    /// Follows a session that was announced since the last call.
    ///
    /// # Errors
    /// The first session cannot be followed, or the shared memory fails.
    pub fn look_for_session<H: SessionHost<Session = S>>(&mut self, host: &mut H) -> Result<()> {
        let Some(announced) = self.reader.announced()? else {
            return Ok(());
        };
        if self.announced.len() == REMEMBERED {
            self.announced.pop_front();
        }
        self.announced.push_back(announced.source);
        let begun = host.begin(&announced, self.active.as_ref());
        let begun = begun.and_then(|session| {
            self.reader.follow(&announced)?;
            Ok(session)
        });
        match (begun, self.active.take()) {
            (Ok(mut next), before) => {
                if let Some(before) = before {
                    host.succeed(&mut next, before)?;
                }
                self.active = Some(next);
            }
            (Err(error), None) => host.refuse(error)?,
            (Err(error), Some(mut running)) => {
                host.reject(&mut running, &error);
                self.active = Some(running);
            }
        }
        Ok(())
    }

    /// Hands the next sample that waits to its session; `None` if none waits.
    ///
    /// # Errors
    /// The host ends the program, or the shared memory fails.
    pub fn take_sample<H: SessionHost<Session = S>>(
        &mut self,
        host: &mut H,
    ) -> Result<Option<Progress>> {
        // asked before: what a producer that is gone has sent is all in the queue
        let had_producer = self.reader.has_producer();
        let active = &mut self.active;
        let taken = self.reader.sample(|sample| {
            match active.as_mut().filter(|s| H::id(s) == sample.source) {
                Some(session) => Ok(host.take(session, sample)),
                // only a sample of another session is copied
                None => Err(*sample),
            }
        })?;
        self.has_lost_producer = taken.is_none() && !had_producer;
        match taken {
            None => Ok(None),
            Some(Ok(progress)) => progress.map(Some),
            Some(Err(foreign)) => {
                // a session is announced before its first sample
                self.look_for_session(host)?;
                let is_of_none = self.active.is_none() && !self.announced.contains(&foreign.source);
                self.unannounced += u64::from(is_of_none && foreign.is_whole());
                let active = self.active.as_mut();
                active
                    .map_or(Ok(Progress::Running), |session| {
                        host.take(session, &foreign)
                    })
                    .map(Some)
            }
        }
    }

    /// Hands all samples that wait to their session, up to its end.
    ///
    /// # Errors
    /// As of [`Self::take_sample`].
    pub fn take_samples<H: SessionHost<Session = S>>(&mut self, host: &mut H) -> Result<Progress> {
        while let Some(progress) = self.take_sample(host)? {
            if progress == Progress::Ended {
                return Ok(Progress::Ended);
            }
        }
        Ok(Progress::Running)
    }
}
