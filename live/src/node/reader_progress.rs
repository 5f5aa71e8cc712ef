//! Progress of a replay's readers. Queues never wait, so a lossless replay waits by this.

use std::collections::BTreeMap;

use anyhow::Result;

use super::port::{Receiver, Sender};
use crate::wire::topics::{WireProgress, WireSample};

/// [`WireProgress::next`] of a reader that has not received a sample yet.
pub const NOTHING_YET: u64 = u64::MAX;

/// Progress of all readers of a session's samples.
#[derive(Debug)]
pub struct ReaderProgress {
    reports: Receiver<WireProgress>,
    session: u64,
    /// Sequence number that each reader expects next, by the reader's identity.
    next: BTreeMap<u128, u64>,
}

impl ReaderProgress {
    /// No reader has reported yet.
    #[must_use]
    pub fn new(reports: Receiver<WireProgress>, session: u64) -> Self {
        Self {
            reports,
            session,
            next: BTreeMap::new(),
        }
    }

    /// Takes all reports. A new reader expects what is sent from now on.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn update(&mut self, sent: u64) -> Result<()> {
        let (next, session) = (&mut self.next, self.session);
        self.reports.receive_all(|report| {
            if report.source == session {
                let reader = u128::from(report.reader_high) << 64 | u128::from(report.reader_low);
                let wanted = next.entry(reader).or_insert(sent);
                if report.next != NOTHING_YET {
                    *wanted = (*wanted).max(report.next);
                }
            }
        })
    }

    /// Returns the number of readers that have taken all samples before this sequence number; some of them may be gone since.
    #[must_use]
    pub fn that_reached(&self, sequence: u64) -> usize {
        let reached = self.next.values().filter(|next| **next >= sequence);
        reached.count()
    }

    /// The lowest sequence number that a reader expects next: `None` if one has not reported yet, `sent` if
    /// there is no reader.
    #[must_use]
    pub fn slowest(&self, samples: &Sender<WireSample>, sent: u64) -> Option<u64> {
        let mut slowest = Some(sent);
        samples.each_reader(|reader| {
            let next = self.next.get(&reader).copied();
            slowest = slowest.zip(next).map(|(a, b)| a.min(b));
        });
        slowest
    }
}
