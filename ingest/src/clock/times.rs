//! The times of all messages of a topic.

use super::stamp::StampSource;

/// Stands for a header without a stamp. No clock shows it: it is 292 years before its zero.
const NO_STAMP: i64 = i64::MIN;

/// The times of all messages of a topic, in file order.
#[derive(Debug, Clone, Default)]
pub struct Times {
    header_ns: Vec<i64>,
    publish_ns: Vec<i64>,
    log_ns: Vec<i64>,
}

impl Times {
    /// Adds a message. A header stamp of zero is none.
    pub fn push(&mut self, header_stamp_ns: Option<i64>, publish_time_ns: i64, log_time_ns: i64) {
        let stamp = header_stamp_ns.filter(|&stamp| stamp != 0);
        self.header_ns.push(stamp.unwrap_or(NO_STAMP));
        self.publish_ns.push(publish_time_ns);
        self.log_ns.push(log_time_ns);
    }

    /// Takes over the times of the messages that follow, and empties the other.
    pub(crate) fn append(&mut self, next: &mut Self) {
        self.header_ns.append(&mut next.header_ns);
        self.publish_ns.append(&mut next.publish_ns);
        self.log_ns.append(&mut next.log_ns);
    }

    /// Header stamp, publish time and log time of each message.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (Option<i64>, i64, i64)> {
        let header = self.header_ns.iter().copied();
        let header = header.map(|stamp| Some(stamp).filter(|&stamp| stamp != NO_STAMP));
        let others = self.publish_ns.iter().zip(&self.log_ns);
        header
            .zip(others)
            .map(|(header, (&publish, &log))| (header, publish, log))
    }

    /// How many messages there are.
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

    /// When the recorder received each message (ns), without the other times.
    pub fn into_log_ns(self) -> Vec<i64> {
        self.log_ns
    }

    /// The time of each message by one of its clocks (ns).
    pub(super) fn by(&self, source: StampSource) -> Vec<Option<i64>> {
        let times = match source {
            StampSource::Header => &self.header_ns,
            StampSource::Publish => &self.publish_ns,
            StampSource::Log => &self.log_ns,
        };
        let stamp = |&time: &i64| Some(time).filter(|&time| time != NO_STAMP);
        times.iter().map(stamp).collect()
    }

    /// The time of a message by one of its clocks (ns).
    pub(super) fn at(&self, index: usize, source: StampSource) -> Option<i64> {
        let time = match source {
            StampSource::Header => self.header_ns[index],
            StampSource::Publish => self.publish_ns[index],
            StampSource::Log => self.log_ns[index],
        };
        Some(time).filter(|&time| time != NO_STAMP)
    }
}
