//! Places single samples of a topic on the clock of its log.

use super::{
    anchor::LogMap,
    line::Line,
    restarts::Pause,
    stamp::StampSource,
    times::{MessageTimes, Times, present, shift_at},
};

/// A stamp further from its expected value is invalid (ns).
pub(super) const IMPOSSIBLE_NS: i64 = 3_600_000_000_000;

/// Placement of the samples of a topic on the clock of their log, sample by sample.
///
/// The placement is known once the times of the whole log are known, and small: samples that were kept with their times can be
/// placed at any later time.
#[derive(Debug, Clone)]
pub struct Placement {
    pub(super) source: StampSource,
    /// Shifts after jumps of the recorder's clock: the first message, and the shift of the log times from there on (ns).
    pub(super) log_shifts: Vec<(usize, i64)>,
    /// Shifts after restarts and steps of the topic's clock: the first message, and the shift from there on (ns).
    pub(super) shifts: Vec<(usize, i64)>,
    /// Messages whose time is ahead of its course, by index, rising.
    pub(super) strays: Vec<usize>,
    /// The expected offset to the log time, if impossible stamps are omitted.
    pub(super) expected: Option<Line>,
    pub(super) correction: Correction,
    pub(super) pauses: Vec<Pause>,
}

/// Correction that maps a time of a message to the clock of the log.
#[derive(Debug, Clone)]
pub(super) enum Correction {
    /// The time is on that clock already.
    None,
    /// The time cannot be mapped.
    Refused,
    /// The clock is ahead by this offset (ns).
    Ahead(i64),
    /// The clock is ahead by an offset that grows with the log time.
    Drifting(Line),
    /// The publish time takes the place of a stamp, after adding this offset.
    Published(Line),
    /// The log time takes the place of a stamp, after adding this offset.
    Logged(LogMap),
}

impl Placement {
    /// Leaves all times as they are: samples that are on the clock of the log already.
    pub(crate) fn as_stamped() -> Self {
        Self {
            source: StampSource::Header,
            log_shifts: Vec::new(),
            shifts: Vec::new(),
            strays: Vec::new(),
            expected: None,
            correction: Correction::None,
            pauses: Vec::new(),
        }
    }

    /// Returns the placement of messages that come after the log, of which `last` was the last: what was fitted to the log is
    /// held at its end, because a line through some seconds says nothing about hours.
    pub(crate) fn held(mut self, last: Option<MessageTimes>) -> Self {
        let Some(last) = last else {
            return self;
        };
        self.expected = self
            .expected
            .map(|line| Line::constant(line.at(last.log_time_ns)));
        self.correction = match self.correction {
            Correction::Drifting(line) => Correction::Ahead(line.at(last.log_time_ns)),
            Correction::Published(line) => {
                Correction::Published(Line::constant(line.at(last.publish_time_ns)))
            }
            Correction::Logged(map) => {
                Correction::Logged(LogMap::constant(map.at(last.log_time_ns)))
            }
            other => other,
        };
        self
    }

    /// The time of measurement of one sample (ns), on the clock of the log; `None` if it has no
    /// usable stamp. `index` counts the samples of the topic from the beginning of the log.
    #[inline]
    pub fn stamp_ns(&self, index: usize, times: &MessageTimes) -> Option<i64> {
        if self.strays.binary_search(&index).is_ok() {
            return None;
        }
        let log_ns = self.log_ns(index, times.log_time_ns);
        let stamp = match &self.correction {
            Correction::Refused => return None,
            Correction::Published(line) => {
                let publish_ns = present(times.publish_time_ns)?;
                publish_ns.saturating_add(line.at(publish_ns))
            }
            Correction::Logged(map) => log_ns.saturating_add(map.at(log_ns)),
            Correction::None => self.possible_stamp_ns(index, times, log_ns)?,
            Correction::Ahead(offset) => self
                .possible_stamp_ns(index, times, log_ns)?
                .saturating_sub(*offset),
            Correction::Drifting(line) => self
                .possible_stamp_ns(index, times, log_ns)?
                .saturating_sub(line.at(log_ns)),
        };
        if self.pauses.is_empty() {
            return Some(stamp);
        }
        let is_before = |pause: &&Pause| pause.is_before(index, log_ns);
        let pauses = self.pauses.iter().filter(is_before);
        let pauses_ns: i64 = pauses.map(|pause| pause.length_ns).sum();
        Some(stamp.saturating_add(pauses_ns))
    }

    /// The log time of a sample without jumps of the recorder's clock (ns).
    #[inline]
    pub fn log_ns(&self, index: usize, log_time_ns: i64) -> i64 {
        match self.log_shifts.is_empty() {
            true => log_time_ns,
            false => log_time_ns.saturating_add(shift_at(&self.log_shifts, index)),
        }
    }

    /// Whether the recorder's clock jumped, so that log times do not tell the order of the samples.
    #[must_use]
    pub fn removes_log_jumps(&self) -> bool {
        !self.log_shifts.is_empty()
    }

    /// The stamp on the topic's own clock, without restarts, unless it is impossible.
    #[inline]
    fn possible_stamp_ns(&self, index: usize, times: &MessageTimes, log_ns: i64) -> Option<i64> {
        let mut stamp = match self.source {
            StampSource::Header => times.header_stamp_ns?,
            StampSource::Publish => present(times.publish_time_ns)?,
            StampSource::Log => present(log_ns)?,
        };
        if !self.shifts.is_empty() {
            stamp = stamp.saturating_add(shift_at(&self.shifts, index));
        }
        let is_impossible = |expected| off_ns(expected, stamp, log_ns).is_some();
        let is_left_out = self.expected.as_ref().is_some_and(is_impossible);
        (!is_left_out).then_some(stamp)
    }

    /// Whether every header stamp stays as it is.
    pub(super) fn keeps_stamps(&self) -> bool {
        self.source == StampSource::Header
            && self.log_shifts.is_empty()
            && self.strays.is_empty()
            && self.shifts.is_empty()
            && self.expected.is_none()
            && matches!(self.correction, Correction::None)
            && self.pauses.is_empty()
    }

    /// The stamps and the log times (ns) of all messages that have a usable stamp, the latter without jumps of the
    /// recorder's clock. The others are passed to `omit`, by their index.
    pub(crate) fn apply(&self, times: Times, omit: impl FnMut(usize)) -> (Vec<i64>, Vec<i64>) {
        if self.keeps_stamps() && times.by(StampSource::Header).missing() == 0 {
            return times.into_header_and_log_ns();
        }
        times.restamped(
            |index, times| {
                let stamp_ns = self.stamp_ns(index, times)?;
                Some((stamp_ns, self.log_ns(index, times.log_time_ns)))
            },
            omit,
        )
    }

    /// Returns the number of messages without a usable stamp.
    pub(crate) fn unstamped(&self, times: &Times) -> u64 {
        if self.keeps_stamps() {
            return times.by(StampSource::Header).missing() as u64;
        }
        self.stamps(times).filter(Option::is_none).count() as u64
    }

    /// The stamps of all messages.
    pub(super) fn stamps<'a>(
        &'a self,
        times: &'a Times,
    ) -> impl Iterator<Item = Option<i64>> + Clone + 'a {
        let all = times.iter().enumerate();
        all.map(|(index, times)| self.stamp_ns(index, &times))
    }
}

/// Returns the deviation of a stamp from its expected value (ns); `None` if the deviation is possible.
#[inline]
pub(super) fn off_ns(expected: &Line, stamp_ns: i64, log_ns: i64) -> Option<i64> {
    let (offset, expected) = (stamp_ns.saturating_sub(log_ns), expected.at(log_ns));
    (!is_possible_offset(offset, expected)).then(|| offset.saturating_sub(expected))
}

/// Whether the offset of a stamp to the log time is possible, given the expected one (ns).
#[inline]
pub(super) fn is_possible_offset(offset_ns: i64, expected_ns: i64) -> bool {
    offset_ns.saturating_sub(expected_ns).unsigned_abs() <= IMPOSSIBLE_NS.unsigned_abs()
}
