//! Ranges of a file that could not be read.

use std::ops::Range;

/// A range of bytes whose frames are lost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lost {
    /// Bytes of the file.
    pub bytes: Range<u64>,
    /// Expected and found content.
    pub reason: String,
    /// Time of the last intact frame before (ns).
    pub after_ns: Option<i64>,
    /// Time of the first intact frame behind (ns); `None` at the end of a file, and where its parts are in no order of time.
    pub before_ns: Option<i64>,
}

/// Most lost ranges that are listed; further ones extend the last one.
const MOST_RANGES: usize = 1000;

/// All losses of a file; adjacent ones are joined.
#[derive(Debug, Default)]
pub(super) struct LostRanges {
    pub(super) ranges: Vec<Lost>,
    pub(super) notes: Vec<String>,
    pub(super) last_time_ns: Option<i64>,
    /// The ranges so far that an intact frame follows.
    followed: usize,
}

impl LostRanges {
    pub(super) fn lose(&mut self, bytes: Range<u64>, reason: impl Into<String>) {
        let is_full = self.ranges.len() >= MOST_RANGES;
        if let Some(last) = self.ranges.last_mut()
            && (is_full || last.bytes.end >= bytes.start && last.after_ns == self.last_time_ns)
        {
            last.bytes.end = last.bytes.end.max(bytes.end);
            last.before_ns = None;
            self.followed = self.followed.min(self.ranges.len() - 1);
            return;
        }
        self.ranges.push(Lost {
            bytes,
            reason: reason.into(),
            after_ns: self.last_time_ns,
            before_ns: None,
        });
    }

    /// An intact frame follows.
    pub(super) fn intact(&mut self, time_ns: i64) {
        self.last_time_ns = Some(time_ns);
        for lost in self.ranges.iter_mut().skip(self.followed) {
            lost.before_ns = Some(time_ns);
        }
        self.followed = self.ranges.len();
    }

    /// Loses the block at a link; links come from the file and may lead anywhere.
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
