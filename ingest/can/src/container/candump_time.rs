//! Times of candump: absolute, as a date, since the first frame, or since the frame before.
//!
//! Nothing in the text says which option of `-t` wrote it. A stamp of ten digits or a date is absolute. Times since the
//! first frame rise on every interface, and times since the frame before do not: that tells them apart after some lines.

use std::collections::HashMap;

use tipwatch_language::word;

use super::{
    calendar::unix_ns,
    lost::LostRanges,
    text::{decimal, seconds},
};

/// Digits of the seconds of an absolute time, as candump pads them.
const ABSOLUTE_DIGITS: usize = 10;
/// Digits of the seconds since another frame, as candump pads them.
const COUNTED_DIGITS: usize = 3;
/// Time from which on a stamp is absolute (ns), in March 1973: no trace counts so long from its first frame.
const ABSOLUTE_NS: i64 = 100_000_000_000_000_000;
/// Rises without a fall that happen by chance once in more than a hundred texts.
const RISES: u32 = 5;
/// Most interfaces that are watched; further ones are ignored.
const MOST_INTERFACES: usize = 256;

/// Time and form of the stamp at the beginning of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamp {
    pub(super) time_ns: i64,
    form: Form,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// Year, month and day.
    Date,
    /// Seconds since 1970.
    Absolute,
    /// Seconds, padded as candump pads the time since another frame.
    Counted,
    /// Seconds as written by other programs.
    Seconds,
}

/// Origin of the times of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CountedFrom {
    /// `candump -ta`, `-tA` and `-l`.
    Epoch,
    /// `candump -tz`.
    FirstFrame,
    /// `candump -td`.
    FrameBefore,
}

/// Splits a line into its stamp, `(seconds)` or `(year-month-day hour:minute:second)`, and the rest.
pub(super) fn stamp(line: &[u8]) -> Option<(Stamp, &[u8])> {
    let inner = line.trim_ascii_start().strip_prefix(b"(")?;
    let end = inner.iter().position(|&byte| byte == b')')?;
    let (text, rest) = (inner.get(..end)?.trim_ascii(), inner.get(end + 1..)?);
    if let Some(time_ns) = date_ns(text) {
        let form = Form::Date;
        return Some((Stamp { time_ns, form }, rest));
    }
    let time_ns = seconds(text)?;
    let digits = text.iter().position(|&byte| byte == b'.');
    let digits = digits.unwrap_or(text.len());
    let form = if digits >= ABSOLUTE_DIGITS || time_ns >= ABSOLUTE_NS {
        Form::Absolute
    } else if digits >= COUNTED_DIGITS && text.starts_with(b"0") {
        Form::Counted
    } else {
        Form::Seconds
    };
    Some((Stamp { time_ns, form }, rest))
}

impl Stamp {
    pub(super) fn is_absolute(self) -> bool {
        matches!(self.form, Form::Date | Form::Absolute)
    }
}

/// `2023-11-14 22:13:20.123456`
fn date_ns(text: &[u8]) -> Option<i64> {
    let space = text.iter().position(|&byte| matches!(byte, b' ' | b'T'))?;
    let (date, clock) = (text.get(..space)?, text.get(space + 1..)?.trim_ascii());
    let mut date = date.split(|&byte| byte == b'-');
    let mut clock = clock.split(|&byte| byte == b':');
    let (year, month, day) = (
        decimal(date.next()?)?,
        decimal(date.next()?)?,
        decimal(date.next()?)?,
    );
    let (hour, minute, second_ns) = (
        decimal(clock.next()?)?,
        decimal(clock.next()?)?,
        seconds(clock.next()?)?,
    );
    unix_ns([year, month, day], [hour, minute], second_ns)
}

/// Evidence of the stamps of a text on the kind of time: absolute, since the first frame, or since the frame before.
#[derive(Debug, Default)]
pub(super) struct Evidence {
    stamps: u64,
    is_absolute: bool,
    /// Whether a stamp is padded as candump does it.
    is_padded: bool,
    starts_at_zero: bool,
    /// The greatest time of every interface.
    greatest_ns: HashMap<Vec<u8>, i64>,
    /// Stamps above the greatest of their interface so far, below it, and equal to it.
    above: u32,
    below: u32,
    equal: u32,
    equal_to_zero: u32,
}

impl Evidence {
    /// Lines of a stream after which a decision stands: a burst of frames may rise for long.
    pub(super) const STREAM_STAMPS: u64 = 64;
    /// Lines of a file, or of a stream, that are looked at.
    pub(super) const MOST_STAMPS: u64 = 4096;

    pub(super) fn take(&mut self, stamp: Stamp, interface: &[u8]) {
        self.stamps += 1;
        if self.stamps == 1 {
            self.is_absolute = stamp.is_absolute();
            self.starts_at_zero = stamp.time_ns == 0;
        }
        self.is_padded |= stamp.form == Form::Counted;
        let Some(greatest_ns) = self.greatest_ns.get_mut(interface) else {
            if self.greatest_ns.len() < MOST_INTERFACES {
                self.greatest_ns.insert(interface.to_vec(), stamp.time_ns);
            }
            return;
        };
        match stamp.time_ns.cmp(greatest_ns) {
            std::cmp::Ordering::Greater => self.above += 1,
            std::cmp::Ordering::Less => self.below += 1,
            std::cmp::Ordering::Equal if stamp.time_ns == 0 => self.equal_to_zero += 1,
            std::cmp::Ordering::Equal => self.equal += 1,
        }
        *greatest_ns = stamp.time_ns.max(*greatest_ns);
    }

    pub(super) fn is_empty(&self) -> bool {
        self.stamps == 0
    }

    /// Whether the first stamp or enough of them decide, so that no further one is needed.
    pub(super) fn is_enough(&self, stamps: u64) -> bool {
        self.stamps > 0 && self.is_absolute || self.stamps >= stamps
    }

    /// Whether another program than candump wrote the stamps, so that a stream need not wait for further ones.
    pub(super) fn is_of_another_program(&self) -> bool {
        self.stamps > 0 && !self.is_padded
    }

    /// Finds the origin of the times; `None` if the stamps do not determine it.
    pub(super) fn counted_from(&self) -> Option<CountedFrom> {
        // a clock that is set back while frames are recorded lets few times fall
        let rises = self.above >= RISES && self.below.saturating_mul(8) <= self.above;
        let falls = self.below > 0 && self.below.saturating_mul(2) >= self.above;
        // one interval again and again
        let is_constant =
            self.below == 0 && self.above <= 1 && self.equal >= 2 && self.equal_to_zero == 0;
        // both count the same up to the second frame
        let is_same = self.stamps == 1 || self.stamps == 2 && self.starts_at_zero;
        if self.is_absolute {
            Some(CountedFrom::Epoch)
        } else if rises || is_same {
            Some(CountedFrom::FirstFrame)
        } else if falls || is_constant {
            Some(CountedFrom::FrameBefore)
        } else if self.is_padded {
            None
        } else {
            // other programs write no intervals
            Some(CountedFrom::FirstFrame)
        }
    }
}

/// Error message for times whose kind is ambiguous, with the remedy.
pub(super) const UNTOLD: &str = "expected times of candump that are absolute, or lines enough to tell times since the first frame (-tz) from times \
     since the frame before (-td), found times that may be either: record with candump -l, or print with candump -ta";

/// Makes times of stamps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    counted_from: CountedFrom,
    sum_ns: i64,
}

impl Clock {
    pub(super) fn new(counted_from: CountedFrom) -> Self {
        Self {
            counted_from,
            sum_ns: 0,
        }
    }

    pub(super) fn time_ns(&mut self, stamp: Stamp, lost: &mut LostRanges) -> i64 {
        if stamp.form == Form::Date {
            lost.note(word!(
                "candump states dates without a time zone: UTC is assumed"
            ));
        }
        match self.counted_from {
            _ if stamp.is_absolute() => stamp.time_ns,
            CountedFrom::Epoch => stamp.time_ns,
            CountedFrom::FirstFrame => {
                lost.note(word!(
                    "the times count from the first frame or another beginning, as those of candump -tz: the date of the \
                     trace is unknown"
                ));
                stamp.time_ns
            }
            CountedFrom::FrameBefore => {
                lost.note(word!(
                    "the times count from the frame before (candump -td) and are summed up: the date of the trace is \
                     unknown"
                ));
                self.sum_ns = self.sum_ns.saturating_add(stamp.time_ns);
                self.sum_ns
            }
        }
    }

    /// Returns the consequence of a line without a readable stamp, beyond the loss of its frame.
    pub(super) fn cost(&self) -> &'static str {
        match self.counted_from {
            CountedFrom::FrameBefore => word!("; all later times are too early by its interval"),
            _ => "",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(stamps: &[&str]) -> Option<CountedFrom> {
        let mut evidence = Evidence::default();
        for text in stamps {
            let (stamp, _) = stamp(text.as_bytes()).unwrap();
            evidence.take(stamp, b"can0");
        }
        evidence.counted_from()
    }

    #[test]
    fn kinds_of_time_are_told_apart() {
        let cases: [(&[&str], Option<CountedFrom>); 9] = [
            (
                &["(0000000012.500000)", "(0000000012.400000)"],
                Some(CountedFrom::Epoch),
            ),
            (
                &["(1700000000.5)", "(1700000000.4)"],
                Some(CountedFrom::Epoch),
            ),
            (&["(2023-11-14 22:13:20.5)"], Some(CountedFrom::Epoch)),
            (
                &[
                    "(000.000000)",
                    "(000.01)",
                    "(000.02)",
                    "(000.03)",
                    "(000.04)",
                    "(000.05)",
                ],
                Some(CountedFrom::FirstFrame),
            ),
            (
                &[
                    "(000.000000)",
                    "(000.010)",
                    "(000.009)",
                    "(000.011)",
                    "(000.010)",
                ],
                Some(CountedFrom::FrameBefore),
            ),
            (
                &["(000.000000)", "(000.010)", "(000.010)", "(000.010)"],
                Some(CountedFrom::FrameBefore),
            ),
            (&["(000.000000)", "(000.010)", "(000.020)"], None),
            (
                &["(000.000000)", "(000.010)"],
                Some(CountedFrom::FirstFrame),
            ),
            (
                &["(0.0)", "(0.010)", "(0.020)"],
                Some(CountedFrom::FirstFrame),
            ),
        ];
        for (stamps, expected) in cases {
            assert_eq!(told(stamps), expected, "{stamps:?}");
        }
    }

    #[test]
    fn val_dates_are_seconds_since_1970() {
        // `date -u -d "2023-11-14 22:13:20" +%s`
        let (found, rest) = stamp(b" (2023-11-14 22:13:20.123456)  can0").unwrap();
        assert_eq!(found.time_ns, 1_700_000_000_123_456_000);
        assert_eq!(rest, b"  can0");
        assert!(stamp(b"(2023-13-14 22:13:20)").is_none() && stamp(b"(2023-11-14)").is_none());
    }
}
