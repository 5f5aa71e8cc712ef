//! The last seconds of a session in memory, bounded in time and in bytes.

use std::collections::VecDeque;

use super::pending::{Dropped, Encoded};

/// Messages in order; the oldest are dropped if they are too old or too many.
#[derive(Debug)]
pub(super) struct Ring {
    messages: VecDeque<Encoded>,
    bytes: usize,
    max_bytes: usize,
    span_ns: i64,
    /// Up to when messages are missing: the newest that was dropped because there were too many, or the first that came to a
    /// recorder that joined later than the session began.
    missing_until_ns: Option<i64>,
}

impl Ring {
    /// A ring of so many bytes, and so much time of the session (ns).
    pub(super) fn new(max_bytes: usize, span_ns: i64) -> Self {
        Self {
            messages: VecDeque::new(),
            bytes: 0,
            max_bytes,
            span_ns,
            missing_until_ns: None,
        }
    }

    /// Adds a message. Those that are older than the ring's time before it are dropped, unless they are `kept`; returns
    /// what was dropped for want of memory.
    pub(super) fn push(&mut self, message: Encoded, are_kept: bool) -> Dropped {
        let oldest_ns = message.session_ns.saturating_sub(self.span_ns);
        self.bytes += message.memory();
        self.messages.push_back(message);
        if !are_kept {
            while (self.messages.front()).is_some_and(|message| message.session_ns < oldest_ns) {
                self.pop();
            }
        }
        self.bound()
    }

    /// Takes the oldest message if it is not later than this (ns).
    pub(super) fn take_until(&mut self, until_ns: i64) -> Option<Encoded> {
        let is_wanted = self.messages.front()?.session_ns <= until_ns;
        is_wanted.then(|| self.pop()).flatten()
    }

    /// Returns messages that could not be written; what was dropped for want of memory.
    pub(super) fn give_back(&mut self, messages: Vec<Encoded>) -> Dropped {
        for message in messages.into_iter().rev() {
            self.bytes += message.memory();
            self.messages.push_front(message);
        }
        self.bound()
    }

    /// Time of the oldest message (ns).
    pub(super) fn first_ns(&self) -> Option<i64> {
        self.messages.front().map(|message| message.session_ns)
    }

    /// Notes that messages before this time (ns) are missing, because nobody recorded them.
    pub(super) fn joins_at(&mut self, time_ns: i64) {
        self.missing_until_ns.get_or_insert(time_ns);
    }

    /// Whether messages after this time (ns) are missing.
    pub(super) fn has_lost_after(&self, time_ns: i64) -> bool {
        self.missing_until_ns
            .is_some_and(|lost_ns| lost_ns >= time_ns)
    }

    fn pop(&mut self) -> Option<Encoded> {
        let oldest = self.messages.pop_front()?;
        self.bytes -= oldest.memory();
        Some(oldest)
    }

    fn bound(&mut self) -> Dropped {
        let mut dropped = Dropped::default();
        while self.bytes > self.max_bytes
            && let Some(oldest) = self.pop()
        {
            self.missing_until_ns = Some(oldest.session_ns);
            dropped.count(oldest.kind);
        }
        dropped
    }

    #[cfg(test)]
    fn times(&self) -> Vec<i64> {
        (self.messages.iter())
            .map(|message| message.session_ns)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::pending::Kind;
    use super::*;
    use proptest::prelude::*;

    fn message(session_ns: i64, bytes: usize) -> Encoded {
        Encoded {
            kind: Kind::Sample(0),
            sequence: 0,
            session_ns,
            log_time_ns: session_ns,
            publish_time_ns: session_ns,
            data: vec![0; bytes],
        }
    }

    #[test]
    fn what_is_too_old_leaves_unless_it_is_kept() {
        let mut ring = Ring::new(1 << 20, 10);
        for time in 0..=20 {
            ring.push(message(time, 8), false);
        }
        assert_eq!(ring.times(), (10..=20).collect::<Vec<_>>());
        for time in 21..=30 {
            ring.push(message(time, 8), true);
        }
        assert_eq!(ring.first_ns(), Some(10));
        assert!(!ring.has_lost_after(0));
        let mut taken = Vec::new();
        while let Some(message) = ring.take_until(12) {
            taken.push(message);
        }
        assert_eq!(ring.first_ns(), Some(13));
        ring.give_back(taken);
        assert_eq!(ring.times(), (10..=30).collect::<Vec<_>>());
    }

    proptest! {
        /// Whatever arrives, the memory is bounded, the newest messages stay, and every other one is counted.
        #[test]
        fn memory_is_bounded(sizes in prop::collection::vec(0..5000_usize, 1..200)) {
            const MOST: usize = 20_000;
            let mut ring = Ring::new(MOST, i64::MAX);
            let mut dropped = 0;
            for (time, bytes) in sizes.iter().enumerate() {
                dropped += ring.push(message(time as i64, *bytes), false).samples;
                let held: usize = ring.messages.iter().map(Encoded::memory).sum();
                prop_assert_eq!(ring.bytes, held);
                prop_assert!(held <= MOST);
            }
            prop_assert_eq!(dropped as usize + ring.messages.len(), sizes.len());
            let newest: Vec<i64> = (dropped as i64..sizes.len() as i64).collect();
            prop_assert_eq!(ring.times(), newest);
            prop_assert_eq!(ring.has_lost_after(dropped as i64 - 1), dropped > 0);
        }
    }
}
