//! The times of all messages of a topic.

use std::ops::Range;

use super::stamp::StampSource;

/// Marks a header without a stamp. No clock reaches it: it is 292 years before zero.
const NO_STAMP: i64 = i64::MIN;

/// The times of one message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MessageTimes {
    /// The stamp in its header (ns); `None` if there is none, or if it is zero.
    pub header_stamp_ns: Option<i64>,
    /// Time at which the message was sent (ns).
    pub publish_time_ns: i64,
    /// Time at which the recorder received the message (ns).
    pub log_time_ns: i64,
}

/// The times of all messages of a topic, in file order.
#[derive(Debug, Clone, Default)]
pub struct Times {
    header_ns: Vec<i64>,
    /// Empty while all publish times equal the log times.
    publish_ns: Vec<i64>,
    log_ns: Vec<i64>,
}

impl Times {
    /// Reserves memory for `messages` messages, if it is available.
    pub(crate) fn reserve_exact(&mut self, messages: usize) {
        let _ = self.header_ns.try_reserve_exact(messages);
        let _ = self.log_ns.try_reserve_exact(messages);
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

    /// Appends the times of the messages that follow.
    pub(crate) fn append(&mut self, next: TimesSlice<'_>) {
        if !self.publish_ns.is_empty() || next.has_publish() {
            self.separate_publish();
            self.publish_ns.extend_from_slice(next.publish_ns);
        }
        self.header_ns.extend_from_slice(next.header_ns);
        self.log_ns.extend_from_slice(next.log_ns);
    }

    /// Removes all times, keeping the memory.
    pub(crate) fn clear(&mut self) {
        self.header_ns.clear();
        self.publish_ns.clear();
        self.log_ns.clear();
    }

    /// The times of all messages.
    pub(crate) fn as_slice(&self) -> TimesSlice<'_> {
        TimesSlice {
            header_ns: &self.header_ns,
            publish_ns: self.publish_ns(),
            log_ns: &self.log_ns,
        }
    }

    /// The times of each message.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = MessageTimes> + Clone {
        self.as_slice().iter()
    }

    /// The number of messages.
    pub fn len(&self) -> usize {
        self.log_ns.len()
    }

    /// Whether there are no times.
    pub fn is_empty(&self) -> bool {
        self.log_ns.is_empty()
    }

    /// Returns the time at which the recorder received each message (ns).
    pub fn log_ns(&self) -> &[i64] {
        &self.log_ns
    }

    /// Returns the times with log times that are shifted from single messages on; publish times that are not apart follow.
    pub(super) fn with_log_shifted(&self, shifts: &[(usize, i64)]) -> Self {
        let mut shifted = self.clone();
        for (index, log_ns) in shifted.log_ns.iter_mut().enumerate() {
            *log_ns = log_ns.saturating_add(shift_at(shifts, index));
        }
        shifted
    }

    /// Returns the header stamps and the log times (ns), unchanged.
    pub(super) fn into_header_and_log_ns(self) -> (Vec<i64>, Vec<i64>) {
        (self.header_ns, self.log_ns)
    }

    /// Gives every message another stamp and log time by its index, and returns both (ns) of those
    /// that get them. The others are passed to `omit`, by their index.
    pub(super) fn restamped(
        mut self,
        stamp_and_log_ns: impl Fn(usize, &MessageTimes) -> Option<(i64, i64)>,
        mut omit: impl FnMut(usize),
    ) -> (Vec<i64>, Vec<i64>) {
        let mut kept = 0;
        for index in 0..self.log_ns.len() {
            let times = self.as_slice().at(index);
            match stamp_and_log_ns(index, &times) {
                Some((stamp_ns, log_ns)) => {
                    // the place of a time that has been read already
                    self.header_ns[kept] = stamp_ns;
                    self.log_ns[kept] = log_ns;
                    kept += 1;
                }
                None => omit(index),
            }
        }
        self.header_ns.truncate(kept);
        self.log_ns.truncate(kept);
        (self.header_ns, self.log_ns)
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

/// The times of consecutive messages.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TimesSlice<'t> {
    header_ns: &'t [i64],
    /// The log times where no publish time differs.
    publish_ns: &'t [i64],
    log_ns: &'t [i64],
}

impl<'t> TimesSlice<'t> {
    /// Messages that are stamped and placed already.
    pub(crate) fn of_placed(stamps_ns: &'t [i64], log_ns: &'t [i64]) -> Self {
        Self {
            header_ns: stamps_ns,
            publish_ns: log_ns,
            log_ns,
        }
    }

    /// Part of the messages.
    pub(crate) fn part(self, range: Range<usize>) -> Self {
        Self {
            header_ns: &self.header_ns[range.clone()],
            publish_ns: &self.publish_ns[range.clone()],
            log_ns: &self.log_ns[range],
        }
    }

    #[inline]
    pub(crate) fn at(self, index: usize) -> MessageTimes {
        MessageTimes {
            header_stamp_ns: present(self.header_ns[index]),
            publish_time_ns: self.publish_ns[index],
            log_time_ns: self.log_ns[index],
        }
    }

    pub(crate) fn iter(self) -> impl ExactSizeIterator<Item = MessageTimes> + Clone + 't {
        let others = self.publish_ns.iter().zip(self.log_ns);
        let all = self.header_ns.iter().zip(others);
        all.map(|(&header, (&publish_time_ns, &log_time_ns))| MessageTimes {
            header_stamp_ns: present(header),
            publish_time_ns,
            log_time_ns,
        })
    }

    /// Returns the time at which the recorder received each message (ns).
    pub(super) fn log_ns(self) -> &'t [i64] {
        self.log_ns
    }

    /// Returns the time at which each message was sent (ns), if these times are stored apart from the log times.
    pub(super) fn apart_ns(self) -> Option<&'t [i64]> {
        self.has_publish().then_some(self.publish_ns)
    }

    /// The header stamps that are there, each with its log time (ns).
    pub(super) fn stamped(self) -> impl Iterator<Item = (i64, i64)> + 't {
        let all = self.header_ns.iter().zip(self.log_ns);
        all.map(|(&stamp, &log)| (stamp, log))
            .filter(|(stamp, _)| *stamp != NO_STAMP)
    }

    /// Whether publish times are stored apart from the log times.
    fn has_publish(self) -> bool {
        !std::ptr::eq(self.publish_ns, self.log_ns)
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

    /// The stamps, if none is missing.
    pub(super) fn complete(self) -> Option<&'t [i64]> {
        (self.missing() == 0).then_some(self.0)
    }

    /// Returns the number of missing stamps.
    pub(super) fn missing(self) -> usize {
        self.0.iter().filter(|&&time| time == NO_STAMP).count()
    }

    /// The stamps from index `index` on.
    pub(super) fn from(self, index: usize) -> Self {
        Self(self.0.get(index..).unwrap_or_default())
    }
}

/// The shift that applies to a message, of those that each apply from a message on (ns).
#[inline]
pub(super) fn shift_at(shifts: &[(usize, i64)], index: usize) -> i64 {
    let next = shifts.partition_point(|(from, _)| *from <= index);
    next.checked_sub(1).map_or(0, |last| shifts[last].1)
}

/// A time, unless it marks that there is none.
#[inline]
pub(super) fn present(time: i64) -> Option<i64> {
    (time != NO_STAMP).then_some(time)
}
