//! Vector ASC: text with a header and one event a line.

use std::io::{self, BufRead};

use tipwatch_language::{say, word};

use super::{
    calendar::unix_ns,
    channels::Channels,
    lost::LostRanges,
    text::{Lines, decimal, hexadecimal, seconds, shown, words},
};
use crate::{
    bits::find,
    frame::{CanId, Frame, FrameKind, MOST_DATA_BYTES},
};

/// Whether a line is one of the header.
pub(super) fn is_header(line: &[u8]) -> bool {
    let mut words = words(line);
    match (words.next(), words.next(), words.next()) {
        (Some(b"base"), Some(b"hex" | b"dec"), Some(b"timestamps")) => true,
        (Some(b"date"), Some(day), Some(_)) => {
            day.len() <= 4 && day.first().is_some_and(u8::is_ascii_alphabetic)
        }
        _ => false,
    }
}

/// Whether a line is a frame, as in a part of a file without its header.
pub(super) fn is_frame(line: &[u8]) -> bool {
    let mut words = words(line);
    let time = words.next();
    time.is_some_and(|time| time.contains(&b'.') && seconds(time).is_some())
        && words.next().and_then(decimal).is_some()
        && words.next().is_some()
        && matches!(words.next(), Some(b"Rx" | b"Tx"))
        && matches!(words.next(), Some(b"d" | b"r"))
}

#[derive(Debug)]
pub(super) struct Asc<R> {
    lines: Lines<R>,
    /// Whether a line stated the base of numbers.
    has_base: bool,
    is_decimal: bool,
    is_relative: bool,
    start_ns: i64,
    /// Time of the last event, for relative times.
    last_ns: i64,
}

/// Kind of a line of an ASC file.
enum Line {
    Frame,
    /// A frame of CAN XL.
    Xl,
    /// An event of another kind, or a comment.
    Other,
    Wrong,
}

impl<R: BufRead> Asc<R> {
    pub(super) fn new(source: R) -> Self {
        Self {
            lines: Lines::new(source),
            has_base: false,
            is_decimal: false,
            is_relative: false,
            start_ns: 0,
            last_ns: 0,
        }
    }

    pub(super) fn next_frame(
        &mut self,
        frame: &mut Frame,
        channels: &mut Channels,
        lost: &mut LostRanges,
    ) -> io::Result<bool> {
        while self.lines.advance()? {
            let line = self.lines.line().to_vec();
            if line.is_empty() || self.header(&line, lost) {
                continue;
            }
            let line_is = match self.lines.is_whole() {
                false => Line::Wrong,
                true => self.event(&line, frame, channels),
            };
            match line_is {
                Line::Frame => {
                    if !self.has_base {
                        self.has_base = true;
                        lost.note(word!(
                            "the file does not state the base of its numbers: they are taken as hexadecimal, and times as absolute"
                        ));
                    }
                    return Ok(true);
                }
                Line::Xl => lost.note(word!(
                    "frames of CAN XL are left out: those of classical CAN and CAN FD are read"
                )),
                Line::Other => {}
                Line::Wrong => {
                    let shown = shown(&line);
                    let reason =
                        say!("expected an event of Vector ASC in a whole line, found \"{shown}\"");
                    self.lines.lose(lost, &reason);
                }
            }
        }
        Ok(false)
    }

    /// Takes a line of the header.
    fn header(&mut self, line: &[u8], lost: &mut LostRanges) -> bool {
        let first = words(line).next().unwrap_or_default();
        match first {
            b"base" => {
                let has = |word: &[u8]| words(line).any(|found| found == word);
                self.has_base = true;
                self.is_decimal = has(b"dec");
                self.is_relative = has(b"relative");
                true
            }
            b"date" => {
                self.date(line.get(4..).unwrap_or_default(), lost);
                true
            }
            b"Begin" | b"begin" | b"Begin_Triggerblock" => {
                if let Some(at) = find(line, b"riggerblock") {
                    // times count from the beginning of the block
                    let date = line.get(at + b"riggerblock".len()..).unwrap_or_default();
                    if !date.trim_ascii().is_empty() {
                        self.date(date, lost);
                    }
                }
                true
            }
            b"End" | b"end" | b"internal" | b"no" => true,
            _ => line.starts_with(b"//"),
        }
    }

    fn date(&mut self, text: &[u8], lost: &mut LostRanges) {
        match date_ns(text) {
            Some(start_ns) => {
                self.start_ns = start_ns;
                lost.note(word!(
                    "the file states its date without a time zone: UTC is assumed"
                ));
            }
            None => lost.note(say!(
                "the date \"{}\" cannot be read: times count from the beginning of the file",
                text.trim_ascii().escape_ascii()
            )),
        }
    }

    fn event(&mut self, line: &[u8], frame: &mut Frame, channels: &mut Channels) -> Line {
        let mut words = words(line);
        let Some(time_ns) = words.next().and_then(seconds) else {
            return Line::Wrong;
        };
        let time_ns = match self.is_relative {
            true => self.last_ns.saturating_add(time_ns),
            false => time_ns,
        };
        self.last_ns = time_ns;
        frame.time_ns = self.start_ns.saturating_add(time_ns);
        match words.next() {
            Some(b"CANFD") if words.clone().nth(1) == Some(b"TxRq") => Line::Other,
            Some(b"CANFD") => match self.fd(words, frame, channels) {
                Some(()) => Line::Frame,
                None => Line::Wrong,
            },
            Some(b"CANXL") => Line::Xl,
            Some(word) => match decimal(word) {
                Some(channel) => self.classical(channel, words, frame, channels),
                // statistics, trigger, other buses
                None => Line::Other,
            },
            None => Line::Wrong,
        }
    }

    fn classical<'l>(
        &self,
        channel: i64,
        mut words: impl Iterator<Item = &'l [u8]>,
        frame: &mut Frame,
        channels: &mut Channels,
    ) -> Line {
        let channel = channel.unsigned_abs();
        frame.is_fd = false;
        let Some(id) = words.next() else {
            return Line::Wrong;
        };
        if id.eq_ignore_ascii_case(b"ErrorFrame") {
            frame.set_error();
            frame.channel = channels.numbered(channel);
            return Line::Frame;
        }
        let id = self.id(id);
        let direction = words.next();
        let id = match (id, direction) {
            // a request to send is no frame of the bus: that follows as Tx, once it is sent
            (_, Some(b"TxRq")) => return Line::Other,
            (Some(id), Some(b"Rx" | b"Tx")) => id,
            // a frame without its identifier, such as by the name of its message
            (Some(_), _) | (None, Some(b"Rx" | b"Tx")) => return Line::Wrong,
            // `Statistic: ...`, `J1939TP ...` and others
            (None, _) => return Line::Other,
        };
        frame.id = id;
        let mut rest = || match words.next()? {
            b"d" => {
                frame.kind = FrameKind::Data;
                let len = self.number(words.next()?)?.min(8) as usize;
                self.data(&mut words, len, frame)
            }
            b"r" => {
                frame.kind = FrameKind::Remote;
                frame.set_data(&[]).then_some(())
            }
            _ => None,
        };
        match rest() {
            Some(()) => {
                frame.channel = channels.numbered(channel);
                Line::Frame
            }
            None => Line::Wrong,
        }
    }

    /// `CANFD channel direction id [name] brs esi dlc length data ...`
    fn fd<'l>(
        &self,
        mut words: impl Iterator<Item = &'l [u8]> + Clone,
        frame: &mut Frame,
        channels: &mut Channels,
    ) -> Option<()> {
        let channel = decimal(words.next()?)?.unsigned_abs();
        let mut next = words.next()?;
        if matches!(next, b"Rx" | b"Tx") {
            next = words.next()?;
        }
        frame.channel = channels.numbered(channel);
        if next.eq_ignore_ascii_case(b"ErrorFrame") {
            frame.set_error();
            return Some(());
        }
        frame.id = self.id(next)?;
        let is_flag = |word: Option<&[u8]>| matches!(word, Some(b"0" | b"1"));
        let mut ahead = words.clone();
        if !is_flag(ahead.next()) || !is_flag(ahead.next()) {
            // the symbolic name
            words.next()?;
        }
        let (brs, esi) = (words.next(), words.next());
        (is_flag(brs) && is_flag(esi)).then_some(())?;
        let _dlc = hexadecimal(words.next()?)?;
        let len = usize::try_from(decimal(words.next()?)?).ok()?;
        frame.kind = FrameKind::Data;
        self.data(&mut words, len, frame)?;
        // flags behind duration and length of the message: bit 12 is set for CAN FD, bit 4 for a remote frame
        let flags = words.nth(2).and_then(hexadecimal);
        frame.is_fd = flags.is_none_or(|flags| flags & 0x1000 != 0) || len > 8;
        if flags.is_some_and(|flags| flags & 0x10 != 0 && flags & 0x1000 == 0) {
            frame.kind = FrameKind::Remote;
            frame.set_data(&[]);
        }
        Some(())
    }

    fn data<'l>(
        &self,
        words: &mut impl Iterator<Item = &'l [u8]>,
        len: usize,
        frame: &mut Frame,
    ) -> Option<()> {
        let mut data = [0; MOST_DATA_BYTES];
        for byte in data.get_mut(..len)? {
            *byte = u8::try_from(self.number(words.next()?)?).ok()?;
        }
        frame.set_data(data.get(..len)?).then_some(())
    }

    fn number(&self, word: &[u8]) -> Option<u32> {
        match self.is_decimal {
            true => u32::try_from(decimal(word)?).ok(),
            false => hexadecimal(word),
        }
    }

    fn id(&self, word: &[u8]) -> Option<CanId> {
        let extended = word.strip_suffix(b"x").or_else(|| word.strip_suffix(b"X"));
        let raw = self.number(extended.unwrap_or(word))?;
        match extended {
            Some(_) => (raw <= 0x1fff_ffff).then(|| CanId::extended(raw)),
            None => (raw <= 0x7ff).then(|| CanId::standard(raw)),
        }
    }
}

/// Beginnings of the names of months in English and German; programs write them in the language of their computer.
const MONTHS: [&[&[u8]]; 12] = [
    &[b"jan", b"j\xe4n", "j\u{e4}n".as_bytes()],
    &[b"feb"],
    &[b"mar", b"mrz", b"m\xe4r", "m\u{e4}r".as_bytes()],
    &[b"apr"],
    &[b"may", b"mai"],
    &[b"jun"],
    &[b"jul"],
    &[b"aug"],
    &[b"sep"],
    &[b"oct", b"okt"],
    &[b"nov"],
    &[b"dec", b"dez"],
];

/// `Sat Sep 30 15:06:13.191 2017`, also with `am` or `pm`; or `30.09.2017 15:06:13.191` and `2017-09-30 15:06:13.191`.
fn date_ns(text: &[u8]) -> Option<i64> {
    let mut words = words(text);
    let first = words.next()?;
    if let Some([year, month, day]) = numeric_date(first) {
        return time_of_day_ns(words.next()?, words.next(), [year, month, day]);
    }
    let month = words.next()?.to_ascii_lowercase();
    let is_month = |names: &[&[u8]]| names.iter().any(|name| month.starts_with(name));
    let month = MONTHS.iter().position(|names| is_month(names))? as i64 + 1;
    let day = decimal(words.next()?)?;
    let clock = words.next()?;
    let mut year = words.next()?;
    let half = (year.len() == 2).then_some(year);
    if half.is_some() {
        year = words.next()?;
    }
    time_of_day_ns(clock, half, [decimal(year)?, month, day])
}

/// Year, month and day of `30.09.2017` or `2017-09-30`.
fn numeric_date(word: &[u8]) -> Option<[i64; 3]> {
    let numbers = |mark: u8| -> Option<[i64; 3]> {
        let parts: Option<Vec<i64>> = word.split(|&byte| byte == mark).map(decimal).collect();
        parts?.try_into().ok()
    };
    let days_first = numbers(b'.').map(|[day, month, year]| [year, month, day]);
    days_first.or_else(|| numbers(b'-'))
}

/// Nanoseconds since 1970 of a date and `15:06:13.191`, with `am` or `pm` behind it or without.
fn time_of_day_ns(clock: &[u8], half: Option<&[u8]>, date: [i64; 3]) -> Option<i64> {
    let mut clock = clock.split(|&byte| byte == b':');
    let (mut hour, minute) = (decimal(clock.next()?)?, decimal(clock.next()?)?);
    let second_ns = seconds(clock.next()?)?;
    match half.map(<[u8]>::to_ascii_lowercase).as_deref() {
        Some(b"pm") => hour = hour % 12 + 12,
        Some(b"am") => hour %= 12,
        _ => {}
    }
    unix_ns(date, [hour, minute], second_ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_without_its_header_is_seen_by_its_frames() {
        for line in [
            &b"    6.474846 1  18FECA03x       Rx   d 8 04 FF 22 EE E3 81 FF FF  Length = 559804"[..],
            b"0.1 2 123 Tx r",
        ] {
            assert!(is_frame(line));
        }
        for line in [
            &b"6 1 18FECA03x Rx d 8"[..],
            b"0.1 1 Statistic: D 1",
            b"0.1 boom 3 Rx d 1",
        ] {
            assert!(!is_frame(line));
        }
    }

    #[test]
    fn val_dates_are_those_of_the_calendar() {
        // `date -u -d "2017-09-30 15:06:13" +%s`
        let expected = 1_506_783_973_191_000_000;
        assert_eq!(date_ns(b" Sat Sep 30 15:06:13.191 2017"), Some(expected));
        assert_eq!(date_ns(b" Sat Sep 30 03:06:13.191 pm 2017"), Some(expected));
        for text in [
            &b" Sam Sep 30 15:06:13.191 2017"[..],
            b" 30.09.2017 15:06:13.191",
            b" 2017-09-30 15:06:13.191",
            b" 30.09.2017 03:06:13.191 PM",
        ] {
            assert_eq!(date_ns(text), Some(expected), "{}", text.escape_ascii());
        }
        // German months, in Latin-1 and UTF-8: `date -u -d "2023-03-07 15:06:13" +%s`, and October, May and December
        for (text, seconds) in [
            (&b" Die M\xe4r 7 15:06:13 2023"[..], 1_678_201_573_i64),
            ("Die M\u{e4}r 7 15:06:13 2023".as_bytes(), 1_678_201_573),
            (b" Die Mrz 7 15:06:13 2023", 1_678_201_573),
            (b" Sam Okt 7 03:06:13 PM 2023", 1_696_691_173),
            (b" Mit Mai 3 15:06:13 2023", 1_683_126_373),
            (b" Mit Dez 6 15:06:13 2023", 1_701_875_173),
        ] {
            let expected = Some(seconds * 1_000_000_000);
            assert_eq!(date_ns(text), expected, "{}", text.escape_ascii());
        }
        assert_eq!(date_ns(b" Sam Okt 40 03:06:13.191 2017"), None);
        assert_eq!(date_ns(b" Sam Xyz 4 03:06:13.191 2017"), None);
    }
}
