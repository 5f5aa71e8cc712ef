//! Messages that wait to be written, between the thread that reads shared memory and the one that waits for
//! the disk.

use std::collections::VecDeque;

use crate::system::sync::{Mutex, MutexGuard, PoisonError};

use super::trigger::Trigger;

/// Bytes that may wait: half a minute of a busy machine.
const MAX_BYTES: usize = 64 << 20;

/// Kind of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A sample of this sensor, by its index among the session's.
    Sample(usize),
    /// A verdict.
    Verdict {
        /// Whether the level of the verdict differs from the one before.
        is_new: bool,
        /// The condition that makes the black box keep it.
        trigger: Option<Trigger>,
    },
    /// A valve command.
    Command,
    /// The monitor's description of itself.
    Program,
    /// A report of messages that the recorder lost.
    Gap,
}

/// A message as written to the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Encoded {
    pub(super) kind: Kind,
    pub(super) sequence: u32,
    /// Time of the session (ns): that of this computer times the pace, or the largest stamp so far in a session without
    /// a pace.
    pub(super) session_ns: i64,
    pub(super) log_time_ns: i64,
    pub(super) publish_time_ns: i64,
    pub(super) data: Vec<u8>,
}

impl Encoded {
    /// Bytes in memory.
    pub(super) fn memory(&self) -> usize {
        self.data.capacity() + size_of::<Self>()
    }
}

/// Messages that were dropped.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Dropped {
    pub(super) samples: u64,
    /// Verdicts and commands, and what a monitor says about itself.
    pub(super) verdicts: u64,
}

impl Dropped {
    pub(super) fn add(&mut self, other: Self) {
        self.samples += other.samples;
        self.verdicts += other.verdicts;
    }

    pub(super) fn count(&mut self, kind: Kind) {
        match kind {
            Kind::Sample(_) => self.samples += 1,
            Kind::Verdict { .. } | Kind::Command | Kind::Program => self.verdicts += 1,
            // the loss that it tells of was counted
            Kind::Gap => {}
        }
    }
}

/// Messages in order. The oldest are dropped if there are too many.
#[derive(Debug, Default)]
pub(super) struct Pending(Mutex<Queue>);

#[derive(Debug, Default)]
struct Queue {
    messages: VecDeque<Encoded>,
    bytes: usize,
    dropped: Dropped,
}

impl Pending {
    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn push(&self, message: Encoded) {
        let mut queue = self.queue();
        queue.bytes += message.data.len();
        queue.messages.push_back(message);
        queue.bound();
    }

    /// Counts messages that were lost before they could be queued.
    pub(super) fn note_dropped(&self, samples: u64, verdicts: u64) {
        let dropped = &mut self.queue().dropped;
        dropped.samples += samples;
        dropped.verdicts += verdicts;
    }

    pub(super) fn is_full(&self) -> bool {
        self.queue().bytes >= MAX_BYTES / 2
    }

    /// All messages that wait, and those dropped since the last call.
    pub(super) fn take(&self) -> (VecDeque<Encoded>, Dropped) {
        let mut queue = self.queue();
        queue.bytes = 0;
        (
            std::mem::take(&mut queue.messages),
            std::mem::take(&mut queue.dropped),
        )
    }

    /// Returns messages that could not be written.
    pub(super) fn give_back(&self, mut messages: VecDeque<Encoded>, dropped: Dropped) {
        let mut queue = self.queue();
        messages.append(&mut queue.messages);
        queue.bytes = messages.iter().map(|message| message.data.len()).sum();
        queue.messages = messages;
        queue.dropped.add(dropped);
        queue.bound();
    }
}

impl Queue {
    fn bound(&mut self) {
        while self.bytes > MAX_BYTES {
            let Some(oldest) = self.messages.pop_front() else {
                return;
            };
            self.bytes -= oldest.data.len();
            self.dropped.count(oldest.kind);
        }
    }
}
