//! The reader of a session: its announcement and its samples. It reports progress to a replay.

use anyhow::Result;

use super::live_node::LiveNode;
use super::port::{Receiver, Sender};
use super::reader_progress::NOTHING_YET;
use crate::wire::topics::{Kind, Topic, Wire, WireProgress, WireSample, WireSession};

/// Samples after which progress is reported even if more wait.
const REPORT_SAMPLES: u32 = 64;

/// Reads the samples of a session.
#[derive(Debug)]
pub struct SampleReader {
    samples: Receiver<WireSample>,
    sessions: Receiver<WireSession>,
    /// `None` where others hold all places.
    progress: Option<Sender<WireProgress>>,
    reports: bool,
    session: u64,
    next: u64,
    reported: u64,
    since_report: u32,
}

impl SampleReader {
    /// Opens the services for reading.
    ///
    /// # Errors
    /// There are too many readers, or another version of this program uses the services.
    pub fn new(node: &LiveNode) -> Result<Self> {
        // the session first: a producer takes a reader of samples as ready
        let sessions = node.receiver()?;
        let progress = node.sender_if_free()?;
        Ok(Self {
            samples: node.receiver()?,
            sessions,
            progress,
            reports: false,
            session: 0,
            next: NOTHING_YET,
            reported: NOTHING_YET,
            since_report: 0,
        })
    }

    /// The latest session announced since the last call.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn announced(&self) -> Result<Option<WireSession>> {
        self.samples.update_connections()?;
        self.sessions.receive(|session| *session)
    }

    /// Follows this session from now on.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn follow(&mut self, session: &WireSession) -> Result<()> {
        self.session = session.source;
        self.reports = session.wants_progress != 0;
        self.next = NOTHING_YET;
        self.report()
    }

    /// Passes the next sample to `take`; `None` if none waits.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn sample<R>(&mut self, take: impl FnOnce(&WireSample) -> R) -> Result<Option<R>> {
        let (mut next, mut is_end) = (None, false);
        let taken = self.samples.receive(|wire| {
            next = Some((wire.source, wire.sequence.wrapping_add(1)));
            is_end = wire.kind == Kind::End as u32;
            take(wire)
        })?;
        if self.reports {
            if is_end {
                // this reader may be gone before it looks for another sample
                self.since_report = REPORT_SAMPLES;
            }
            self.keep_reporting(next)?;
        }
        Ok(taken)
    }

    /// Whether a producer exists, including a dead one that was not removed yet.
    #[must_use]
    pub fn has_producer(&self) -> bool {
        self.samples.writers() > 0
    }

    fn keep_reporting(&mut self, next: Option<(u64, u64)>) -> Result<()> {
        match next {
            Some((session, next)) if session == self.session => {
                self.next = next;
                self.since_report += 1;
                if self.since_report < REPORT_SAMPLES {
                    return Ok(());
                }
            }
            Some(_) => return Ok(()),
            None if self.next == self.reported => return Ok(()),
            None => {}
        }
        self.report()
    }

    fn report(&mut self) -> Result<()> {
        self.since_report = 0;
        self.reported = self.next;
        if !self.reports {
            return Ok(());
        }
        let Some(progress) = &mut self.progress else {
            return Ok(());
        };
        let reader = self.samples.id();
        let mut report = WireProgress {
            reader_low: reader as u64,
            reader_high: (reader >> 64) as u64,
            next: self.next,
            ..WireProgress::blank()
        };
        progress.send_as(self.session, &mut report)
    }
}

const _: () = assert!(
    <WireSample as Topic>::HISTORY == 0,
    "late joiners must not get old samples"
);
