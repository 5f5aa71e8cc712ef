//! The times of all messages of a topic.

use super::stamp::StampSource;
use crate::large_columns;

/// Marks a header without a stamp. No clock reaches it: it is 292 years before zero.
const NO_STAMP: i64 = i64::MIN;

/// The times of all messages of a topic, in file order.
#[derive(Debug, Clone, Default)]
pub struct Times {
    header_ns: Vec<i64>,
    /// Empty while all publish times equal the log times.
    publish_ns: Vec<i64>,
    log_ns: Vec<i64>,
}

impl Times {
    /// Reserves memory for `messages` messages, if available.
    pub(crate) fn reserve(&mut self, messages: u64) {
        large_columns::reserve(&mut self.header_ns, messages);
        large_columns::reserve(&mut self.log_ns, messages);
    }

    /// Adds a message. A header stamp of zero counts as missing.
    #[inline]
    pub fn push(&mut self, header_stamp_ns: Option<i64>, publish_time_ns: i64, log_time_ns: i64) {
        let stamp = header_stamp_ns.filter(|&stamp| stamp != 0);
        self.header_ns.push(stamp.unwrap_or(NO_STAMP));
        if publish_time_ns != log_time_ns || !self.publish_ns.is_empty() {
            self.separate_publish();
            self.publish_ns.push(publish_time_ns);
        }
        self.log_ns.push(log_time_ns);
    }

    /// Starts to store publish times, which equalled the log times so far.
    fn separate_publish(&mut self) {
        if self.publish_ns.is_empty() {
            self.publish_ns.extend_from_slice(&self.log_ns);
        }
    }

    /// Appends and empties the times of the messages that follow.
    pub(crate) fn append(&mut self, next: &mut Self) {
        if !self.publish_ns.is_empty() || !next.publish_ns.is_empty() {
            self.separate_publish();
            self.publish_ns.extend_from_slice(next.publish_ns());
            next.publish_ns.clear();
        }
        self.header_ns.append(&mut next.header_ns);
        self.log_ns.append(&mut next.log_ns);
    }

    /// Header stamp, publish time and log time of each message.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (Option<i64>, i64, i64)> {
        let others = self.publish_ns().iter().zip(&self.log_ns);
        let header = self.by(StampSource::Header).iter();
        header
            .zip(others)
            .map(|(header, (&publish, &log))| (header, publish, log))
    }

    /// The number of messages.
    pub fn len(&self) -> usize {
        self.log_ns.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.log_ns.is_empty()
    }

    /// When the recorder received each message (ns).
    pub fn log_ns(&self) -> &[i64] {
        &self.log_ns
    }

    /// The log times only (ns).
    pub fn into_log_ns(self) -> Vec<i64> {
        self.log_ns
    }

    fn publish_ns(&self) -> &[i64] {
        match self.publish_ns.is_empty() {
            true => &self.log_ns,
            false => &self.publish_ns,
        }
    }

    /// The times of one source.
    pub(super) fn by(&self, source: StampSource) -> Stamps<'_> {
        Stamps(match source {
            StampSource::Header => &self.header_ns,
            StampSource::Publish => self.publish_ns(),
            StampSource::Log => &self.log_ns,
        })
    }
}

/// The stamps of all messages of a topic from one source (ns); some may be missing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stamps<'t>(&'t [i64]);

impl<'t> Stamps<'t> {
    pub(super) fn len(self) -> usize {
        self.0.len()
    }

    /// The stamp of one message.
    #[inline]
    pub(super) fn at(self, index: usize) -> Option<i64> {
        present(self.0[index])
    }

    /// The stamps of all messages.
    pub(super) fn iter(self) -> impl Iterator<Item = Option<i64>> + Clone + 't {
        self.0.iter().map(|&time| present(time))
    }

    /// The stamps from index `index` on.
    pub(super) fn from(self, index: usize) -> Self {
        Self(self.0.get(index..).unwrap_or_default())
    }
}

#[inline]
fn present(time: i64) -> Option<i64> {
    (time != NO_STAMP).then_some(time)
}
