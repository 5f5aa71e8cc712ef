//! What of a file could not be read.

use std::ops::Range;

/// A range of bytes whose frames are lost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lost {
    /// Bytes of the file.
    pub bytes: Range<u64>,
    /// What was expected and what was found.
    pub reason: String,
    /// Time of the last intact frame before (ns).
    pub after_ns: Option<i64>,
}

/// Beyond it, further ranges extend the last one.
const MOST_RANGES: usize = 1000;

/// All losses of a file; adjacent ones are joined.
#[derive(Debug, Default)]
pub(super) struct LostRanges {
    pub(super) ranges: Vec<Lost>,
    pub(super) notes: Vec<String>,
    pub(super) last_time_ns: Option<i64>,
}

impl LostRanges {
    pub(super) fn lose(&mut self, bytes: Range<u64>, reason: impl Into<String>) {
        let is_full = self.ranges.len() >= MOST_RANGES;
        if let Some(last) = self.ranges.last_mut()
            && (is_full || last.bytes.end >= bytes.start && last.after_ns == self.last_time_ns)
        {
            last.bytes.end = last.bytes.end.max(bytes.end);
            return;
        }
        self.ranges.push(Lost {
            bytes,
            reason: reason.into(),
            after_ns: self.last_time_ns,
        });
    }

    /// Loses what a link leads to; links come from the file and may lead anywhere.
    pub(super) fn lose_link(&mut self, link: u64, file_len: u64, reason: impl Into<String>) {
        self.lose(
            link.min(file_len)..link.saturating_add(1).min(file_len),
            reason,
        );
    }

    pub(super) fn note(&mut self, note: impl Into<String>) {
        let note = note.into();
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }
}
